"""A block on a patch of bristles (tests/proof/patch_world), whose author had read neither the tool nor its generator.

An effect is strong if its largest size reaches 1.5, which is the least that the generator asks for: then its onsets
change by 1.5 times their scatter, or its slides by 0.75 mm, and so on (pilot.py). Where it acted is what the generator
recorded: by how much each run differs from the same run without the effect, in the pilot's units.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from shared.rig import RigConfig
from tests.proof.families import Family, Json
from tests.proof.families.own import at_its_mass
from tests.proof.key import Concealed, Truth
from tests.proof.parameters import Map, Values
from tests.proof.patch_world.effects import EFFECTS
from tests.proof.protocol import Protocol

RUNS = 60
_ANSWERS = {"null": "none", "artefact": "artefact", "outside": "other"}
STRONG = 1.5 * (1.0 - 1e-3)
SLIDE_MM, REST_MM, MARK_MM, TURN_DEG, ANGLE_DEG = 0.5, 0.03, 0.05, 1.0, 0.2
"""The units of a changed slide, of what a block seems to move at rest, of a shifted picture, of a turn during the slide
and of an angle that the inclinometer contradicts (pilot.py)."""


def _numbers(**names: str) -> Callable[[Values, Truth, RigConfig], Values | None]:
    return lambda true, _truth, _rig: {name: true[of] for name, of in names.items()}


def _nap(true: Values, _truth: Truth, _rig: RigConfig) -> Values:
    where = "sole" if true["sole_nap"] else "plate"
    size, axis = true[f"{where}_nap"], true[f"{where}_nap_axis"]
    return {"cos1": size * math.cos(axis), "sin1": size * math.sin(axis)}


def _corner(true: Values, _truth: Truth, _rig: RigConfig) -> Values:
    # Friction grows by the share `lopsided` over half the sole, whose second moment is half² / 3.
    arm = {f"{axis}_m": true[f"lopsided_{axis}"] * true["half_x"] / 3.0 for axis in "xy"}
    return {**arm, "lead": true["mu"] * 0.5 * true["height"] / (2.0 * true["half_x"])}


def _polish(true: Values, _truth: Truth, _rig: RigConfig) -> Values:
    # 1 − p (1 − exp(−(n − 1) / n0)) over its value at n = 0, which mu holds.
    rest, lost = 1.0 - true["polish"], true["polish"] * math.exp(1.0 / true["polish_runs"])
    return {"fall": lost / (rest + lost), "runs": true["polish_runs"]}


def _direct(true: Values, _truth: Truth, _rig: RigConfig) -> Values:
    return {"per_e_fold": true["direct"], "slower_decades": -1.0 - math.log10(true["direct_speed"])}


def _bend(true: Values, _truth: Truth, rig: RigConfig) -> Values:
    nearer = 1.0 - rig.block.size_m[2] / (1e-3 * rig.camera.height_mm)
    shift = true["bend_px"] * nearer / (1e3 * rig.camera.px_per_mm)
    if true["bend_along"]:
        return {"shift_m": shift}
    return {"fixed_x_m": shift * math.cos(true["bend_axis"]), "fixed_y_m": shift * math.sin(true["bend_axis"])}


def _leaning(true: Values, _truth: Truth, _rig: RigConfig) -> Values:
    sine = math.hypot(true["lean_x"], true["lean_y"])
    each = math.asin(sine) / sine if sine else 1.0
    return {"eps_x_rad": -each * true["lean_y"], "eps_y_rad": each * true["lean_x"]}


EXACT: Mapping[str, Map] = {
    "stribeck": Map(_numbers(drop="weak_drop", speed_m_s="weak_speed"), "Bo and Pavelka's fall, the law with tail 0"),
    "rate_strengthening": Map(_direct, "asinh(v / 2 v0), the law with both_ways 1; the speed in decades below 0.1 m/s"),
    "viscous": Map(_numbers(drag_n_s_m="film"), "the same force", at_its_mass),
    "wear": Map(_polish, "the same exponential, one run later"),
    "one_way_friction": Map(_nap, "the same share, by the way that the bristles bend"),
    "uneven_contact": Map(_corner, "friction that is linear over a sole, on which the pressure balances"),
    "platform_level": Map(
        _leaning,
        "gravity's tangential part on the level plate, and the rotation vector that makes it",
    ),
    "backlash": Map(_numbers(half_width_rad="play"), "half the play"),
    "pivot_offset": Map(
        lambda true, _truth, _rig: {f"{axis}_m": -true[f"pivot_{axis}"] for axis in "xyz"},
        "where the pivot is from the stated one, and where the block is from the pivot",
    ),
    "clock_offset": Map(_numbers(delay_s="stamp_s"), "the arm's stamps are early by what the camera's seem late"),
    "camera_sag": Map(_bend, "pixels at a vertical plate, metres where the block's mark is"),
    "rolling_shutter": Map(_numbers(readout_s="readout_s"), "the same read-out"),
}
INEXACT: Mapping[str, str] = {
    "kinetic_drop": "slip weakening, over some micrometres",
    "contact_aging": "contacts are renewed by slip as well",
    "presliding": "elasto-plastic bristles",
    "friction_patch": "spots or a random field there, a series here",
    "plate_anisotropy": "an elliptic limit curve with an associated flow",
    "object_anisotropy": "an elliptic limit curve with an associated flow",
    "border_contact": "foam that yields, and gives back a part",
    "angle_scale": "a gain and an offset",
    "arm_vibration": "five tones",
    "lens_distortion": "by focal lengths, and towards the distorted picture",
}


class PatchWorld(Family):
    """Sessions of 60 runs."""

    name: ClassVar[str] = "patch_world"
    title: ClassVar[str] = "patch world"
    place: ClassVar[int] = 10
    rivalled: ClassVar[bool] = True
    quick: ClassVar[Mapping[str, int]] = MappingProxyType({"null": 1, "single": 2})
    full: ClassVar[Mapping[str, int]] = MappingProxyType(
        {"null": 50, "null_nuisance": 50, "single": 48, "pair": 24, "outside": 18}
    )

    def generator(self) -> list[str]:
        """It knows nothing of the proof."""
        return ["tests.proof.patch_world", "--runs", str(RUNS)]

    def names(self, told: Json) -> list[str]:
        """The key has a list."""
        return [entry["case"] for entry in told["cases"]]

    def complete(self, protocol: Protocol, tier: str, name: str) -> bool:
        """The truth is written last."""
        return _truth_path(protocol, tier, name).exists()

    def truths(self, protocol: Protocol, tier: str, told: Json) -> Iterator[Truth]:
        """Yields what the key and the record of the truth say."""
        for entry in told["cases"]:
            acted = json.loads(_truth_path(protocol, tier, entry["case"]).read_text("utf-8"))["acted"]
            yield truth_of(entry, acted)

    def maps(self) -> Mapping[str, Map]:
        """See EXACT."""
        return EXACT

    def inexact(self) -> Mapping[str, str]:
        """See INEXACT."""
        return INEXACT


def _truth_path(protocol: Protocol, tier: str, name: str) -> Path:
    return protocol.key(tier) / "truth" / f"{name}.json"


def truth_of(entry: Json, acted: Mapping[str, Sequence[Json]]) -> Truth:
    """A case's line of the key, with the record of where its effects acted."""
    world = entry["world"]
    kind = "null" if entry["tier"].startswith("null") else entry["tier"]
    return Truth(
        id=entry["case"],
        tier=entry["tier"],
        answer=_ANSWERS.get(kind, "effects"),
        effects=tuple(_concealed(effect, world, acted[effect["effect"]]) for effect in entry["effects"]),
        members=(),
        next=(),
        design={},
        kind=kind,
    )


def _concealed(effect: Json, world: Json, acted: Sequence[Json]) -> Concealed:
    planted = EFFECTS[effect["effect"]]
    sizes: Mapping[str, float] = effect["sizes"]
    size = sizes[planted.shows] if planted.shows else max(sizes.values())
    parts = ("contact", "history", "sensing", "camera")
    parameters: dict[str, Any] = {name: value for part in parts for name, value in world[part].items()}
    parameters |= dict(zip(("lopsided_x", "lopsided_y"), world["patch"]["lopsided"], strict=True))
    return Concealed(
        id=effect["effect"] if effect["catalogue"] == "none" else effect["catalogue"],
        also=tuple(effect["also"]),
        strength=size,
        strong=size >= STRONG,
        parameters=parameters,
        onset_signs={},
        path_signs={},
        acted=_sizes(acted, _scatter_deg(world)),
    )


def _scatter_deg(world: Json) -> float:
    """The scatter of onsets between equal runs."""
    mu = world["contact"]["mu"]
    return math.degrees(world["scatter"]["run_sd"] * mu / (1 + mu * mu))


def _sizes(acted: Sequence[Json], scatter_deg: float) -> dict[tuple[str, int], float]:
    """Returns how much an effect acted in each phase of each run; mu absorbs a change of all onsets alike.

    A shift of the picture that is there on the level plate is of the camera at rest; one that comes as the plate tilts,
    as a bending mast's does, is of the time before the slip, like a block's creep and an angle's error.
    """
    onsets = [one["onset_deg"] for one in acted if one["onset_deg"] is not None]
    level = float(np.median(onsets)) if onsets else 0.0
    found: dict[tuple[str, int], list[float]] = {}
    for one in acted:
        run, rest, slide = one["run"], one["phases"].get("rest", {}), one["phases"].get("slide", {})
        onset = None if one["onset_deg"] is None else abs(one["onset_deg"] - level)
        found["onset", run] = _in_units((onset, scatter_deg))
        found["slide", run] = _in_units((one["slide_mm"], SLIDE_MM), (slide.get("yaw_deg"), TURN_DEG))
        found["pre-slip", run] = _in_units(
            (rest.get("path_mm"), REST_MM),
            (rest.get("level_deg"), ANGLE_DEG),
            (rest.get("fiducial_moved_mm"), MARK_MM),
        )
        found["rest", run] = _in_units((rest.get("fiducial_begin_mm"), MARK_MM))
    return {cell: max(sizes) for cell, sizes in found.items() if sizes}


def _in_units(*sizes: tuple[float | None, float]) -> list[float]:
    """The sizes that are known, each in its unit."""
    return [size / unit for size, unit in sizes if size is not None]
