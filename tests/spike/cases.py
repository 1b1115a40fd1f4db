"""Makes a concealed case for the spike: `python -m tests.spike.cases OUT KIND INDEX SEED`.

KIND is null, single or pair. Singles have 2 or 4 detection limits, pairs only effects that the spike knows. Sessions
are shorter than the generator's own (50 to 150 runs): they cost a quarter of the time.
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path

from numpy.random import Generator

import tests.concealed.protocols as protocols
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
    if kind != "single":
        return plan_case(kind, index, seed=seed, only=KNOWN if kind == "pair" else ())
    wanted = 2 + (index + index // len(KNOWN)) % 2
    turn = next(turn for turn in range(4 * index, 4 * index + 4) if turn % len(STRENGTHS) == wanted)
    return plan_case("single", turn, seed=seed, only=(KNOWN[index % len(KNOWN)],))


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
