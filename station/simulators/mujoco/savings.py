"""The steps that a twin's world may skip because they cannot matter: a scheduler that knows no physics itself.

Each answer is a number of looks (10 ms) that may pass before the next one, or whether something may be done at all. A
test compares onsets with `SAVING` and with `EVERYTHING` (tests/unit/simulators/test_onset.py).
"""

from __future__ import annotations

from dataclasses import dataclass

KEPT_M_S2, SPENT_M_S2, MOST_LEFT_OUT = 0.5, 0.1, 9
"""The acceleration that a block could take beyond the plate's, less what is kept, says how many looks are
left out while the arm moves: one for each time that much, which a plate that turns by 1 rad/s takes meanwhile."""
PRESSED_M_S2, DOZES = 0.3, 4
"""The foam's push per mass from which on a block that lies still is left alone, and for how many looks at a time."""


@dataclass(frozen=True, kw_only=True)
class Savings:
    """`welds` lets a block that holds well become a part of the plate; `skips` lets time pass at once at rest."""

    welds: bool = True
    skips: bool = True
    most_left_out: int = MOST_LEFT_OUT
    dozes: int = DOZES

    def looks_left_out(self, slack_m_s2: float) -> int:
        """Gives the looks at a part of the plate that may be skipped while it could be accelerated by so much more."""
        if slack_m_s2 <= KEPT_M_S2:
            return 0
        return min(int((slack_m_s2 - KEPT_M_S2) / SPENT_M_S2), self.most_left_out)

    def looks_asleep(self, push_m_s2: float) -> int:
        """Gives the number of looks at a loose block that may be skipped while the foam presses on it with so much."""
        return self.dozes if push_m_s2 > PRESSED_M_S2 else 0


SAVING = Savings()
EVERYTHING = Savings(welds=False, skips=False, most_left_out=0, dozes=0)
"""The setting that skips nothing."""
