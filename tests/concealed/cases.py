"""One case: drawn from its tier, number and seed, planned without being written, then written."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.random import Generator

from tests.concealed.catalogue import Effect, Planted, plant
from tests.concealed.design import Design, Setting
from tests.concealed.files import rig_toml, write_session
from tests.concealed.imitate import imitation
from tests.concealed.limits import MOST_RUNS, POWER_SIGMAS, Analyst, Signature
from tests.concealed.protocols import draw_setting
from tests.concealed.sealing import Origin, generator, short
from tests.concealed.session import SessionRecord, run_session
from tests.concealed.world import NULL, World

TIERS = ("null", "null_nuisance", "single", "pair", "confounded", "absorbed", "outside", "artefact")
STRENGTHS = (0.5, 1.0, 2.0, 4.0)
_ATTEMPTS = 6
_KNOWN = ("mu", "load_reference_n", "wall_radius", "side", "px_per_m", "mark_side", "mark_height", "camera_height")
"""The parameters of a world that a user knows, or finds at once."""
_Json = dict[str, Any]


@dataclass(frozen=True, eq=False, kw_only=True)
class Plan:
    """A case before it is written. `entry` is its line of the key; `generators` are for session and file."""

    id: str
    setting: Setting
    mu_guess: float
    entry: _Json
    origin: Origin

    def session(self) -> SessionRecord:
        """The session; always the same."""
        return run_session(self.setting, generator(self.origin, "session"))


@dataclass(frozen=True, eq=False, kw_only=True)
class Strong:
    """A planted effect with its strength, and the limit that the strength is counted in."""

    planted: Planted
    value: float
    limit: float

    def described(self, world: World) -> _Json:
        """For the key: parameters are the world's own, an adhesion in newtons."""
        fields = self.planted.fields(world, self.value)
        return {
            "id": self.planted.effect.id,
            "value": short(self.value),
            "unit": self.planted.effect.unit,
            "detection_limit": short(self.limit),
            "strength": short(self.value / self.limit),
            "parameters": {name: short(value) for name, value in fields.items()},
        }


def origin_of(tier: str, index: int, seed: int) -> Origin:
    """Returns the origin of everything that is random in a case."""
    return seed, TIERS.index(tier), index


# --- strengths --------------------------------------------------------------------------------------------------------


Change = Callable[[Design], Design]


def at_strength(
    rng: Generator,
    effects: Sequence[Effect],
    strengths: Sequence[float],
    *,
    without: Sequence[str] = (),
    change: Change = lambda design: design,
    align: Callable[[list[Planted]], list[Planted]] = lambda planted: planted,
    needs: Sequence[str] | None = None,
) -> tuple[Setting, list[Strong]]:
    """A setting in which every effect has its strength, in limits of its own, and is still physics.

    Settings are drawn until the effects stay below their caps; later attempts have more runs and less scatter. The
    protocol has what the effects need (or `needs`), nothing of `without`, and is then changed by `change`; `align`
    turns the effects towards each other.
    """
    best: tuple[float, Setting, list[Strong]] | None = None
    wanted = {name for effect in effects for name in effect.needs} if needs is None else set(needs)
    for attempt in range(_ATTEMPTS):
        runs = None if attempt < 2 else min(500, 150 + 90 * attempt)
        setting = draw_setting(rng, needs=sorted(wanted), without=without, runs=runs, calm=attempt > 0)
        setting = replace(setting, design=change(setting.design))
        planted = align([plant(effect, rng) for effect in effects])
        analyst = Analyst(run_session(setting, np.random.default_rng(rng.integers(2**63))), most_runs=MOST_RUNS)
        strong = [_strong(one, analyst, strength) for one, strength in zip(planted, strengths, strict=True)]
        worst = max(s * one.limit / one.planted.effect.cap for one, s in zip(strong, strengths, strict=True))
        if best is None or worst < best[0]:
            best = (worst, setting, strong)
        if worst <= 1.0:
            break
    assert best is not None
    return with_effects(best[1], best[2]), best[2]


def _strong(planted: Planted, analyst: Analyst, strength: float) -> Strong:
    effect = planted.effect
    limit = analyst.limit(planted.apply, start=effect.nominal, onset_only=effect.onset_only)
    return Strong(planted=planted, value=min(strength * limit, effect.cap), limit=limit)


def with_effects(setting: Setting, strong: Sequence[Strong]) -> Setting:
    """The setting in a world that has these effects."""
    world = setting.world
    for one in strong:
        world = one.planted.apply(world, one.value)
    return replace(setting, world=world)


# --- the key ----------------------------------------------------------------------------------------------------------


def null_world(world: World) -> World:
    """The same rig and pair without any effect."""
    return NULL._replace(**{name: getattr(world, name) for name in _KNOWN})


def entry_of(tier: str, setting: Setting, strong: Sequence[Strong], session: SessionRecord) -> _Json:
    """A case's line of the key: what is in it, how strong, and where it should be seen."""
    design, world = asdict(setting.design), setting.world
    entry: _Json = {
        "tier": tier,
        "effects": [one.described(world) for one in strong],
        "baseline": {"mu_s": short(world.mu)},
        "nuisance": {name: short(value) for name, value in asdict(setting.nuisance).items()},
        "design": {**design, "opening_m": short(2.0 * (world.wall_radius + 0.65 * world.side))},
        "censored_runs": [int(run.facts.number) + 1 for run in session.runs if run.censored],
        "foam_runs": [int(run.facts.number) + 1 for run in session.runs if run.ride.touched],
        "tipped_runs": [int(run.facts.number) + 1 for run in session.runs if run.ride.tipped],
        "knocked_runs": [int(run.facts.number) + 1 for run in session.runs if math.isfinite(run.facts.knock_at_s)],
        "places": [],
    }
    analyst = Analyst(session) if strong else None
    for one in strong:
        assert analyst is not None
        without = analyst.signature(_without(world, one))
        entry["places"].append(_place_of(one, without))
    return entry


def _without(world: World, one: Strong) -> World:
    return world._replace(**{name: getattr(NULL, name) for name in one.planted.scaled})


def _place_of(one: Strong, signature: Signature) -> _Json:
    shifted = signature.onset - (signature.onset.mean() if len(signature.onset) else 0.0)
    return {
        "effect": one.planted.effect.id,
        "where": [{"phase": phase, "covariate": covariate} for phase, covariate in one.planted.effect.places],
        "detectability": short(math.sqrt(signature.information) / POWER_SIGMAS),
        "runs": signature.runs.tolist(),
        "onset_sigmas": [round(float(value), 2) for value in shifted],
        "path_sigmas": [round(float(value), 2) for value in signature.path],
    }


# --- writing ----------------------------------------------------------------------------------------------------------


def write_case(plan: Plan, out: Path) -> None:
    """Writes a case's folder, the recording last."""
    folder = out / plan.id
    folder.mkdir(parents=True, exist_ok=True)
    rig = rig_toml(plan.setting, mu_guess=plan.mu_guess, scatter_guess=0.1)
    (folder / "rig.toml").write_text(rig, encoding="utf-8")
    session = plan.session()
    if artefact := plan.entry.get("artefact"):
        simulated = imitation(session, artefact=artefact)
        rng = generator(plan.origin, "simulated")
        write_session(simulated, folder / "sim.mcap", rig=rig, rng=rng, mode="lockstep")
    write_session(session, folder / "session.mcap", rig=rig, rng=generator(plan.origin, "file"))
