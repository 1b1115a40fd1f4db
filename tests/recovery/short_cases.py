"""The cases of tests/concealed in short sessions: `python -m tests.recovery.short_cases`, with the same options."""

from __future__ import annotations

import sys
from collections.abc import Collection

from tests.concealed.cases import TIERS, Plan, write_case
from tests.concealed.making import make
from tests.concealed.protocols import at_most
from tests.concealed.tiers import plan_case

MOST_RUNS = 70
"""Runs of the longest session, of 50 in the shortest. A case's time grows with its runs, and what is concealed in it is
as large in the limits of its own session as in those of a longer one."""


def plan_short(tier: str, index: int, *, seed: int, only: Collection[str] = ()) -> Plan:
    """Returns the plan of a tier's case number `index`, as `plan_case` does."""
    with at_most(MOST_RUNS):
        return plan_case(tier, index, seed=seed, only=only)


if __name__ == "__main__":
    about = sys.modules[__name__].__doc__
    sys.exit(
        make(
            None,
            prog="python -m tests.recovery.short_cases",
            about=about,
            tiers=TIERS,
            plan=plan_short,
            write=write_case,
        )
    )
