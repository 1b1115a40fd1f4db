"""Makes concealed cases for the spike: `python -m tests.spike.cases OUT KIND COUNT SEED`.

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
from tests.concealed.cases import STRENGTHS, write_case
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


def plans(kind: str, count: int, seed: int):
    """Yields the plans of a kind; singles take each effect in turn at 2 or 4 limits."""
    for index in range(count):
        if kind != "single":
            yield plan_case(kind, index, seed=seed, only=KNOWN if kind == "pair" else ())
            continue
        wanted = 2 + (index + index // len(KNOWN)) % 2
        name = KNOWN[index % len(KNOWN)]
        turn = next(turn for turn in range(4 * index, 4 * index + 4) if turn % len(STRENGTHS) == wanted)
        yield plan_case("single", turn, seed=seed, only=(name,))


def main() -> None:
    """Writes the cases and their key."""
    out, kind, count, seed = Path(sys.argv[1]), sys.argv[2], int(sys.argv[3]), int(sys.argv[4])
    protocols.draw_runs = draw_runs
    out.mkdir(parents=True, exist_ok=True)
    key = out / f"key_{kind}.json"
    told = json.loads(key.read_text()) if key.exists() else {}
    for plan in plans(kind, count, seed):
        if plan.id not in told:
            write_case(plan, out)
            told[plan.id] = plan.entry
            key.write_text(json.dumps(told))


if __name__ == "__main__":
    main()
