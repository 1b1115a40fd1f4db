"""What may not take for ever: motions, corners, and the block's coming to rest."""

from __future__ import annotations

from station.sampling.state import State

_LOOKING = ("DWELL", "REFERENCE", "TILT")
"""The phases that cannot go on without corners; after the slip a run ends without them."""


def overdue(state: State) -> str:
    """Why the run must be given up now, in one sentence; empty while nothing is overdue."""
    plan = state.plan
    if state.awaited and state.since(state.asked_ns) > plan.timeout_s:
        return f"expected the arm to finish its motion within {plan.timeout_s:g} s, it did not"
    if state.phase in _LOOKING and state.since(state.found_ns) > plan.silence_s:
        return f"expected corners of the marker, got none for {plan.silence_s:g} s"
    if state.phase == "DWELL" and state.waited(plan.timeout_s + state.run.dwell_wanted_s):
        return "expected the block to come to rest on the level plate, it still moves"
    return ""
