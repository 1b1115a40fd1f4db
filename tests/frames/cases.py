"""One case: drawn from its tier, number and seed, planned without being written, then written."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from numpy.random import Generator

from shared.clock import SIMULATION_EPOCH_NS
from shared.errors import UserError
from shared.rig import load_rig
from station.app import assembly
from station.app.lockstep import Lockstep
from station.recording.provenance import Provenance, versions
from station.recording.writer import Recording
from tests.concealed.design import PAIRS
from tests.concealed.sealing import Origin, case_id, generator, short
from tests.frames.effects import EFFECTS, NOTHING, Effect, Parameters
from tests.frames.rig import camera_builder, friction_of, world_builder
from tests.frames.sessions import RIG_ID, Design, draw_design, rig_toml

TIERS = ("twin_null", "frames")
FIRST_TIER = 100
"""Number of the first tier, beyond those of tests/concealed: no case shares its random numbers with one of theirs."""
FRAMES_RUNS = 40
NULL_EVERY = 3
LEFT_OUT = frozenset({"truth/scene", "tf"})
"""The truth; and the transforms, which follow from the rest and take a third of the file."""
FEWEST = 0.5
"""A session that had to end before this share of its runs is no case."""
ATTEMPTS = 5
"""A session that had to end early is begun again, as on a real rig, with other random numbers."""


@dataclass(frozen=True, kw_only=True)
class Plan:
    """A case before it is written; `entry` is its line of the key."""

    id: str
    tier: str
    design: Design
    mean_mu: float
    mu_guess: float
    effect: str
    parameters: Parameters
    entry: dict[str, Any]
    origin: Origin


def plan_case(tier: str, index: int, *, seed: int, only: Collection[str] = ()) -> Plan:
    """The plan of a tier's case number `index`; the same arguments give the same plan.

    Raises:
        ValueError: if no effect is called as `only` says.
    """
    origin = (seed, FIRST_TIER + TIERS.index(tier), index)
    rng = generator(origin, "design")
    effect = _effect_of(tier, index, seed, only)
    pair = list(PAIRS)[(index + seed) % len(PAIRS)]
    runs = FRAMES_RUNS if tier == "frames" else round(math.exp(float(rng.uniform(math.log(50), math.log(120)))))
    design = draw_design(rng, pair=pair, runs=runs, needs=effect.needs if effect else ())
    parameters = effect.draw(rng) if effect else {}
    mean_mu = design.mean_mu * math.exp(float(rng.normal(0.0, 0.05)))
    return Plan(
        id=case_id(origin),
        tier=tier,
        design=design,
        mean_mu=mean_mu,
        mu_guess=mean_mu * math.exp(float(rng.normal(0.0, 0.08))),
        effect=effect.id if effect else "",
        parameters=parameters,
        entry=_entry(tier, design, mean_mu, effect, parameters),
        origin=origin,
    )


def _effect_of(tier: str, index: int, seed: int, only: Collection[str]) -> Effect | None:
    """Each effect in turn, from one that the seed says; every third case has none, if not `only` some are wanted."""
    names = [name for name in EFFECTS if not only or name in only]
    if not names:
        raise ValueError(f"expected some of {', '.join(EFFECTS)}, got {', '.join(only)}")
    if tier == "twin_null":
        return None
    if only:
        return EFFECTS[names[index % len(names)]]
    if index % NULL_EVERY == NULL_EVERY - 1:
        return None
    return EFFECTS[names[(seed + index - index // NULL_EVERY) % len(names)]]


def _entry(tier: str, design: Design, mean_mu: float, effect: Effect | None, parameters: Parameters) -> dict[str, Any]:
    """A case's line of the key, as tests/concealed writes it; no detection limit is known here."""
    effects: list[dict[str, Any]] = []
    if effect is not None:
        told = {name: short(value) for name, value in parameters.items()}
        size = math.hypot(*parameters.values()) if effect.id == "platform_level" else parameters[effect.value]
        effects = [
            {
                "id": effect.id,
                "value": short(size),
                "unit": effect.unit,
                "detection_limit": short(math.inf),
                "strength": 0.0,
                "parameters": told,
            }
        ]
    return {
        "tier": tier,
        "answer": "effects" if effects else "none",
        "effects": effects,
        "baseline": {"mu_s": short(mean_mu)},
        "design": asdict(design),
        "places": [],
    }


def write_case(plan: Plan, out: Path) -> None:
    """Writes a case's folder, the recording last.

    Raises:
        UserError: if all attempts had to end before half of their runs.
    """
    folder = out / plan.id
    folder.mkdir(parents=True, exist_ok=True)
    text = rig_toml(plan.design, mu_guess=plan.mu_guess)
    (folder / "rig.toml").write_text(text, encoding="utf-8")
    origin = Provenance(
        rig_id=RIG_ID,
        started_ns=SIMULATION_EPOCH_NS,
        mode="lockstep",
        rig_toml=text,
        versions={"repose": versions()["repose"]},
    )
    path = folder / "session.mcap"
    told = ""
    for attempt in range(ATTEMPTS):
        rng = generator(plan.origin, f"session {attempt}" if attempt else "session")
        with Recording(path, provenance=origin, overwrite=True, flush_every_s=10.0) as recording:
            outcome = session_of(plan, folder / "rig.toml", recording, rng=rng).run()
        if outcome.samples >= FEWEST * plan.design.runs:
            return
        path.unlink()
        told = f"{outcome.samples}: {outcome.fault}"
    raise UserError(
        f"Expected {plan.design.runs} runs in case {plan.id} of tier {plan.tier}, but {ATTEMPTS} sessions ended early, "
        f"the last after {told}; take another seed"
    )


def session_of(plan: Plan, rig_file: Path, recording: Recording | None, *, rng: Generator) -> Lockstep:
    """The session as it really is, under the rig file that says less."""
    rig = load_rig(rig_file)
    changes = EFFECTS[plan.effect].changes(plan.parameters) if plan.effect else NOTHING
    session_plan = plan.design.plan(int(rng.integers(2**31)))
    return Lockstep(
        rig,
        session_plan,
        recording=recording,
        camera=camera_builder(plan.design, changes, pixels=plan.tier == "frames", rng=rng),
        world=world_builder(friction_of(plan.design, plan.mean_mu, changes), changes),
        left_out=LEFT_OUT,
        tilter=assembly.require_reachable(rig, session_plan),
    )
