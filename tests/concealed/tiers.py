"""Each tier plans what its cases conceal."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from statistics import NormalDist
from typing import Any

from numpy.random import Generator

from tests.concealed.cases import (
    STRENGTHS,
    Plan,
    Strong,
    at_strength,
    entry_of,
    origin_of,
    with_effects,
)
from tests.concealed.catalogue import BEYOND, EFFECTS, TIPPING, Effect, Planted, plant
from tests.concealed.design import Design, Setting
from tests.concealed.protocols import draw_setting
from tests.concealed.sealing import case_id, generator
from tests.concealed.session import run_session

Drawn = tuple[Setting, list[Strong], dict[str, Any]]
"""A setting, what is concealed in it, and what else the key says."""
Draw = Callable[[Generator, int, Collection[str]], Drawn]
_SEPARATES_DIRECTIONS = ("yaw", "mounts", "free")


def _null(rng: Generator, _index: int, _only: Collection[str]) -> Drawn:
    return draw_setting(rng), [], {"answer": "none"}


def _null_nuisance(rng: Generator, _index: int, _only: Collection[str]) -> Drawn:
    return draw_setting(rng, harsh=True), [], {"answer": "none"}


# --- one effect -------------------------------------------------------------------------------------------------------


def _turn(names: Collection[str], index: int, only: Collection[str]) -> tuple[str, int, int]:
    """Each name in turn: the name, its place among those, and how often it has had its turn."""
    left = [name for name in names if not only or name in only]
    if not left:
        raise ValueError(f"expected some of {', '.join(names)}, got {', '.join(only)}")
    return left[index % len(left)], index % len(left), index // len(left)


def _single(rng: Generator, index: int, only: Collection[str]) -> Drawn:
    name, place, turn = _turn([*EFFECTS, TIPPING.id], index, only)
    strength = STRENGTHS[(place + turn) % len(STRENGTHS)]
    if name == TIPPING.id:
        return _tipping(rng, strength)
    setting, strong = at_strength(rng, [EFFECTS[name]], [strength])
    return setting, strong, {"answer": "effects"}


def _tipping(rng: Generator, strength: float) -> Drawn:
    """A tall block: the stronger, the larger the share of the runs in which it tips before it slides."""
    setting = draw_setting(rng, without=("masses",))
    share = {0.5: 0.02, 1.0: 0.06, 2.0: 0.2, 4.0: 0.5}[strength]
    mean = math.atan(setting.world.mu)
    tips_at = mean * (1.0 + setting.nuisance.scatter * NormalDist().inv_cdf(1.0 - share))
    world = setting.world._replace(mark_height=setting.world.side / math.tan(tips_at))
    planted = Planted(effect=TIPPING, fixed={}, scaled={"tips_at": 1.0})
    setting = replace(setting, world=world)
    strong = [Strong(planted=planted, value=tips_at, limit=tips_at / strength)]
    return with_effects(setting, strong), strong, {"answer": "effects"}


def _outside(rng: Generator, index: int, only: Collection[str]) -> Drawn:
    name, place, turn = _turn(BEYOND, index, only)
    setting, strong = at_strength(rng, [BEYOND[name]], [(4.0, 2.0)[(place + turn) % 2]])
    return setting, strong, {"answer": "other"}


# --- two effects ------------------------------------------------------------------------------------------------------

_MASKING = (
    ("kinetic_drop", "viscous"),
    ("kinetic_drop", "rate_strengthening"),
    ("stribeck", "viscous"),
    ("platform_level", "one_way_friction"),
    ("camera_sag", "presliding"),
    ("object_anisotropy", "plate_anisotropy"),
)
_TOGETHER = (
    ("contact_aging", "wear"),
    ("wear", "object_anisotropy"),
    ("contact_aging", "kinetic_drop"),
    ("adhesion", "wear"),
    ("plate_anisotropy", "platform_level"),
    ("friction_patch", "stribeck"),
    ("load_dependence", "kinetic_drop"),
    ("clock_offset", "contact_aging"),
    ("camera_sag", "plate_anisotropy"),
    ("lens_distortion", "wear"),
    ("uneven_contact", "one_way_friction"),
    ("rate_strengthening", "friction_patch"),
)


def _as_drawn(planted: list[Planted]) -> list[Planted]:
    return planted


def _opposed(planted: list[Planted]) -> list[Planted]:
    """Turns a nap of the plate so that it lowers the onset where the plate's level raises it."""
    level, nap = planted
    axis = math.atan2(level.scaled["level_y"], level.scaled["level_x"])
    against = replace(nap, fixed={"nap_plate_axis": axis % (2.0 * math.pi)}, scaled={"nap_plate": 1.0})
    return [level, against]


def _pair(rng: Generator, index: int, only: Collection[str]) -> Drawn:
    pairs = [pair for pair in (*_MASKING, *_TOGETHER) if not only or set(pair) <= set(only)]
    if not pairs:
        raise ValueError(f"expected two of the effects that are paired, got {', '.join(only)}")
    pair = pairs[index % len(pairs)]
    align = _opposed if pair == ("platform_level", "one_way_friction") else _as_drawn
    strengths = [float(rng.choice([2.0, 4.0])) for _ in pair]
    setting, strong = at_strength(rng, [EFFECTS[name] for name in pair], strengths, align=align)
    return setting, strong, {"answer": "effects", "masking": pair in _MASKING}


# --- what the design cannot split -------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Class:
    """Effects that a protocol cannot tell apart, and the protocols' features (any one) that would."""

    name: str
    effects: tuple[str, ...]
    others: tuple[str, ...]
    """Members of the class that are not planted."""
    next: tuple[tuple[str, ...], ...]
    needs: tuple[str, ...] = ()
    without: tuple[str, ...] = ()
    change: Callable[[Design], Design] = lambda design: design


def _fixed(**changes: Any) -> Callable[[Design], Design]:
    return lambda design: replace(design, **changes)


CLASSES = (
    Class(
        name="grain of block or plate, yaw never varied", effects=("object_anisotropy", "plate_anisotropy"), others=(),
        needs=("free",), without=("yaw", "mounts"), next=(("yaw",), ("mounts",)),
    ),
    Class(
        name="level or nap, plate never turned", effects=("platform_level", "one_way_friction"), others=(),
        needs=("free",), without=("yaw", "mounts", "sensor"), next=(("mounts",), ("yaw", "mounts"), ("sensor",)),
    ),
    Class(
        name="a shuttle: start place is previous direction", effects=("platform_level", "one_way_friction"),
        others=("friction_patch",), without=("yaw", "mounts", "sensor", "replace", "free"),
        change=_fixed(shuttle=True, directions=(0, 2), free=False, handled_every=0),
        next=(("mounts",), ("replace",), ("free",), ("sensor",)),
    ),
    Class(
        name="adhesion or load, two near masses", effects=("adhesion", "load_dependence"), others=(),
        needs=("masses",), change=_fixed(masses=(0.7, 1.4)), next=(("masses",), ("area",)),
    ),
    Class(
        name="ageing or rate, dwell never varied", effects=("contact_aging",),
        others=("clock_offset", "pivot_offset"), needs=("rates",), without=("dwell",),
        change=_fixed(rates_deg_s=(2.0, 16.0)), next=(("dwell",),),
    ),
    Class(
        name="ageing or wear, dwell falls with the runs", effects=("contact_aging", "wear"), others=(),
        needs=("dwell",), change=_fixed(dwell_falls=True, dwell_s=(0.3, 6.0)), next=(("dwell",),),
    ),
    Class(
        name="a sudden fall of friction: drop or Stribeck at once", effects=("stribeck",), others=("kinetic_drop",),
        next=(("rates",), ("low_speed",), ("frame_rate",)),
    ),
)  # fmt: skip


def _at_once(planted: list[Planted]) -> list[Planted]:
    return [replace(one, fixed=one.fixed | {"fall_speed": 3e-4}) for one in planted]


def _in_plate(planted: list[Planted]) -> list[Planted]:
    """A nap in the plate, whatever was drawn."""
    (one,) = planted
    axis = one.fixed.get("nap_plate_axis", one.fixed.get("nap_object_axis", 0.0))
    return [replace(one, fixed={"nap_plate_axis": axis}, scaled={"nap_plate": 1.0})]


_ALIGN = {"stribeck": _at_once, "one_way_friction": _in_plate}


def _confounded(rng: Generator, index: int, only: Collection[str]) -> Drawn:
    cases = [(kind, name) for kind in CLASSES for name in kind.effects if not only or name in only]
    if not cases:
        raise ValueError(f"expected some of the effects that are confounded, got {', '.join(only)}")
    kind, name = cases[index % len(cases)]
    setting, strong = at_strength(
        rng, [EFFECTS[name]], [float(rng.choice([2.0, 4.0]))], needs=kind.needs, without=kind.without,
        change=kind.change, align=_ALIGN.get(name, lambda planted: planted),
    )  # fmt: skip
    told = {"name": kind.name, "members": sorted({*kind.effects, *kind.others}), "next": [list(n) for n in kind.next]}
    return setting, strong, {"answer": "class", "class": told}


# --- what mu absorbs --------------------------------------------------------------------------------------------------

_ABSORBED: tuple[tuple[str, tuple[float, float], str], ...] = (
    ("angle_scale", (0.02, 0.08), "sensor"),
    ("angle_offset", (0.01, 0.04), "sensor"),
    ("adhesion", (0.05, 0.4), "masses"),
    ("load_dependence", (0.05, 0.3), "masses"),
)


def _absorbed(rng: Generator, index: int, only: Collection[str]) -> Drawn:
    name, _, _ = _turn([row[0] for row in _ABSORBED], index, only)
    rows = [row for row in _ABSORBED if row[0] == name]
    _, (low, high), missing = rows[0]
    effect: Effect = EFFECTS["angle_scale" if name == "angle_offset" else name]
    planted = plant(effect, rng)
    if name == "angle_offset":
        planted = replace(planted, scaled={"offset": planted.scaled["scale"]})
    setting = draw_setting(rng, without=(missing, "dwell"))
    strong = [Strong(planted=planted, value=float(rng.uniform(low, high)), limit=math.inf)]
    return with_effects(setting, strong), strong, {"answer": "untestable", "next": [[missing]]}


# --- the simulator's own ----------------------------------------------------------------------------------------------


def _artefact(rng: Generator, index: int, _only: Collection[str]) -> Drawn:
    """A plain world, beside a simulation of it whose contacts creep or whose cone is a pyramid."""
    name = ("solver_creep", "cone_artifact")[index % 2]
    needs = ("free",) if name == "cone_artifact" else ()
    setting = draw_setting(rng, needs=needs, without=("yaw", "mounts", "masses"))
    return setting, [], {"answer": "artefact", "artefact": name, "simulated": "sim.mcap"}


_DRAWS: dict[str, Draw] = {
    "null": _null,
    "null_nuisance": _null_nuisance,
    "single": _single,
    "pair": _pair,
    "confounded": _confounded,
    "absorbed": _absorbed,
    "outside": _outside,
    "artefact": _artefact,
}


def plan_case(tier: str, index: int, *, seed: int, only: Collection[str] = ()) -> Plan:
    """The plan of a tier's case number `index`; the same arguments give the same plan.

    Raises:
        ValueError: if nothing of the tier is called as `only` says.
    """
    origin = origin_of(tier, index, seed)
    rng = generator(origin, "design")
    setting, strong, more = _DRAWS[tier](rng, index, only)
    session = run_session(setting, generator(origin, "session"))
    return Plan(
        id=case_id(origin),
        setting=setting,
        mu_guess=setting.world.mu * math.exp(float(rng.normal(0.0, 0.08))),
        entry=entry_of(tier, setting, strong, session) | more,
        origin=origin,
    )
