"""Makes a concealed case for the spike: `python -m tests.spike.cases OUT KIND INDEX SEED`.

KIND is null, wander (a null whose friction wanders along each path by 1 to 4 %), single or pair.
Singles have 2 or 4 detection limits, pairs only effects that the spike knows. Sessions
are shorter than the generator's own (50 to 150 runs): they cost a quarter of the time.
"""

from __future__ import annotations

import json
import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.random import Generator

from tests.concealed import protocols
from tests.concealed.cases import STRENGTHS, Plan, write_case
from tests.concealed.tiers import plan_case

KNOWN = (
    "kinetic_drop", "stribeck", "rate_strengthening", "viscous", "contact_aging", "wear", "object_anisotropy",
    "plate_anisotropy", "one_way_friction", "friction_patch", "platform_level", "clock_offset", "camera_sag",
)  # fmt: skip
"""The effects that the spike knows."""
FEWEST, MOST = 50, 150


def draw_runs(rng: Generator) -> int:
    """50 to 150 runs, uniform in the logarithm."""
    return round(math.exp(float(rng.uniform(math.log(FEWEST), math.log(MOST)))))


def plan_one(kind: str, index: int, seed: int) -> Plan:
    """The plan of a kind's case number `index`; singles take each effect in turn at 2 or 4 limits."""
    if kind == "wander":
        return plan_wander(index, seed)
    if kind != "single":
        return plan_case(kind, index, seed=seed, only=KNOWN if kind == "pair" else ())
    wanted = 2 + (index + index // len(KNOWN)) % 2
    turn = next(turn for turn in range(4 * index, 4 * index + 4) if turn % len(STRENGTHS) == wanted)
    return plan_case("single", turn, seed=seed, only=(KNOWN[index % len(KNOWN)],))


def plan_wander(index: int, seed: int) -> Plan:
    """A null in which friction wanders over 2 to 8 mm of the path."""
    plan = plan_case("null", index, seed=seed, only=())
    rng = np.random.default_rng([seed, index])
    size, length = math.exp(rng.uniform(math.log(0.01), math.log(0.04))), rng.uniform(0.002, 0.008)
    world = plan.setting.world._replace(wander=size, wander_length=length)
    entry = plan.entry | {"wander": {"size": size, "length_m": length}}
    return replace(plan, id=f"{plan.id}w", setting=replace(plan.setting, world=world), entry=entry)


def main() -> None:
    """Writes the case and its key."""
    out, kind, index, seed = Path(sys.argv[1]), sys.argv[2], int(sys.argv[3]), int(sys.argv[4])
    key = out / "key" / f"{kind}_{index:02d}_{seed}.json"
    if key.exists():
        return
    protocols.draw_runs = draw_runs
    plan = plan_one(kind, index, seed)
    key.parent.mkdir(parents=True, exist_ok=True)
    write_case(plan, out)
    key.write_text(json.dumps({plan.id: plan.entry}))


if __name__ == "__main__":
    main()
