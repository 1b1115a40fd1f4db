"""The first generator (tests/concealed): event-driven, its own laws, effects at 0.5 to 4 times a detection limit."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import ClassVar

from shared.rig import RigConfig
from station.physics.effects.viscous import REFERENCE_KG
from tests.proof.families import Family
from tests.proof.key import Truth
from tests.proof.parameters import Map, Values

CONVEX = 0.4
"""The largest ln of the extremes' ratio at which a radius 1 + a cos 2ψ is convex: a = 1/5."""


def _same(**names: str) -> Callable[[Values, Truth, RigConfig], Values | None]:
    return lambda true, _truth, _rig: {name: true[of] for name, of in names.items()}


def _twice(where: str) -> Callable[[Values, Truth, RigConfig], Values | None]:
    def to_tool(true: Values, _truth: Truth, _rig: RigConfig) -> Values | None:
        size, axis = true[f"grain_{where}"], true[f"grain_{where}_axis"]
        if true[f"grain_{where}_shape"] != 0.0 and abs(size) > CONVEX:
            return None
        return {"cos2": size * math.cos(2 * axis), "sin2": size * math.sin(2 * axis)}

    return to_tool


def _nap(true: Values, _truth: Truth, _rig: RigConfig) -> Values | None:
    where = "object" if true.get("nap_object", 0.0) else "plate"
    size, axis = true[f"nap_{where}"], true[f"nap_{where}_axis"]
    return {"cos1": size * math.cos(axis), "sin1": size * math.sin(axis)}


def _shape0(shape: str, **names: str) -> Callable[[Values, Truth, RigConfig], Values | None]:
    return lambda true, _truth, _rig: (
        {name: true[of] for name, of in names.items()} if true.get(shape, 0.0) == 0.0 else None
    )


def _rate(true: Values, _truth: Truth, _rig: RigConfig) -> Values:
    return {"per_e_fold": true["rate_gain"], "slower_decades": -1.0 - math.log10(true["rate_speed"])}


def _viscous(true: Values, truth: Truth, rig: RigConfig) -> Values | None:
    one_mass = len(set(truth.design["masses"])) == 1
    return {"drag_n_s_m": true["drag_per_s"] * _mass_kg(truth, rig)} if one_mass else None


def _mass_kg(truth: Truth, rig: RigConfig) -> float:
    """The block's, where it is the only one; other generators know one mass only."""
    return truth.design.get("masses", (1.0,))[0] * rig.block.mass_kg


def at_its_mass(told: Values, truth: Truth, rig: RigConfig) -> float:
    """The tool states the drag of a block of 8 g, and how drag goes with the load: here the block's own is compared."""
    return (_mass_kg(truth, rig) / REFERENCE_KG) ** told.get("by_load", 0.0)


def _sag(true: Values, _truth: Truth, rig: RigConfig) -> Values:
    # Metres where the block's mark is, which is nearer to the camera than the plate.
    nearer = 1.0 - rig.block.size_m[2] / (1e-3 * rig.camera.height_mm)
    return {"shift_m": -true["sag_px"] * nearer / (1e3 * rig.camera.px_per_mm)}


EXACT: Mapping[str, Map] = {
    "kinetic_drop": Map(_same(drop="drop"), "the same share"),
    "stribeck": Map(_shape0("fall_shape", drop="fall", speed_m_s="fall_speed"), "exponential; not the Lorentzian"),
    "rate_strengthening": Map(_rate, "the same law; the cut-off in decades below 0.1 m/s"),
    "viscous": Map(_viscous, "per mass in the generator: the same law only where the mass is one", at_its_mass),
    "wear": Map(_shape0("wear_shape", fall="wear", runs="wear_runs"), "exponential; not the straight drift"),
    "object_anisotropy": Map(_twice("object"), "the extremes' ratio at twice the angle; a cosine where it is convex"),
    "plate_anisotropy": Map(_twice("plate"), "the extremes' ratio at twice the angle; a cosine where it is convex"),
    "one_way_friction": Map(_nap, "the same share, in the plate's grain or the block's"),
    "adhesion": Map(_same(force_n="adhesion_n"), "the same force"),
    "load_dependence": Map(_same(exponent="load_power"), "the same exponent; the reference load is in mu"),
    "uneven_contact": Map(_same(x_m="uneven_x", y_m="uneven_y"), "the same point in the block's frame"),
    "platform_level": Map(
        lambda true, _truth, _rig: {"eps_x_rad": -true["level_y"], "eps_y_rad": true["level_x"]},
        "gravity's tangential part on the level plate, and the rotation vector that makes it",
    ),
    "angle_scale": Map(
        lambda true, _truth, _rig: {"gain": true.get("scale", 0.0)} if not true.get("offset", 0.0) else None,
        "the same gain; the generator's offset fades out towards level and is another law",
    ),
    "backlash": Map(
        lambda true, _truth, _rig: {"half_width_rad": 0.5 * true["play"]}, "the whole play, and half of it"
    ),
    "clock_offset": Map(_same(delay_s="late_s"), "the same delay"),
    "camera_sag": Map(_sag, "pixels along the image's uphill, metres down the slope"),
    "lens_distortion": Map(_same(k1="lens"), "the same term over half the image"),
    "rolling_shutter": Map(_same(readout_s="readout_s"), "the same readout"),
}
INEXACT: Mapping[str, str] = {
    "contact_aging": "reference time and cutoff differ, and the power law is another law",
    "com_offset": "it moves the angle at which a block topples; the generator's blocks do not topple by it",
    "friction_patch": "a spot or waves there, a series here",
    "presliding": "another law of the load",
    "border_contact": "another depth: the generator's lip has a width",
    "pivot_offset": "the generator leaves the centripetal part out",
    "arm_vibration": "three tones there, a random push here",
    "tipping": "an angle there, a slenderness here",
}


class Own(Family):
    """Every single effect comes at each of four strengths, every pair and every kind of the others about twice."""

    name: ClassVar[str] = "own"
    title: ClassVar[str] = "own generator"
    place: ClassVar[int] = 0
    rivalled: ClassVar[bool] = True
    quick: ClassVar[Mapping[str, int]] = MappingProxyType(
        {"null": 4, "single": 6, "outside": 2, "absorbed": 1, "confounded": 1}
    )
    full: ClassVar[Mapping[str, int]] = MappingProxyType(
        {
            "null": 100, "null_nuisance": 100, "single": 100, "pair": 36, "confounded": 14, "absorbed": 8,
            "outside": 24, "artefact": 6,
        }
    )  # fmt: skip

    def generator(self) -> list[str]:
        """It shares nothing with the tool."""
        return ["tests.concealed"]

    def maps(self) -> Mapping[str, Map]:
        """See EXACT."""
        return EXACT

    def inexact(self) -> Mapping[str, str]:
        """See INEXACT."""
        return INEXACT
