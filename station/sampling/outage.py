"""An outage: the plate is brought back to level, and the session waits until everybody is heard again."""

from __future__ import annotations

import math

from station.sampling.state import State
from station.sampling.tracks import Tracks

_BACK_S = 1.0
"""Everybody must have been heard for this long: a link that has just come back may go again."""
_AGAIN_S = 5.0
"""A command to level that nobody has answered is repeated after this."""

_LEVEL_RAD = math.radians(0.5)
"""An arm within this angle of level counts as level: it settles within 0.3 degrees (`settle_tolerance_deg`)."""


class Outage:
    """The behaviour of a session while it cannot hear camera or arm; it is asked at every tick."""

    def __init__(self, state: State, tracks: Tracks) -> None:
        self._state, self._tracks = state, tracks
        self._back_ns = 0
        self._asked_ns = 0

    def over(self) -> bool:
        """Returns true once the session may go on.

        It levels the plate meanwhile, and ends a session that may wait no longer.
        """
        state = self._state
        if state.absent:
            self._back_ns = state.now_ns
            self._level()
            self._give_up()
            return False
        if state.since(max(self._back_ns, state.phase_ns)) < _BACK_S:
            return False
        state.say("warning", f"everybody is heard again after {state.since(state.phase_ns):.0f} s: going on")
        state.outage, self._asked_ns = "", 0
        return True

    def _level(self) -> None:
        """Asks for level while the arm is there: it would hold a tilt for as long as the camera is away."""
        state = self._state
        arm_there = state.since(state.attitude_ns) <= state.plan.silence_s
        asked_lately = bool(self._asked_ns) and state.since(self._asked_ns) < _AGAIN_S
        if arm_there and not asked_lately and self._tracks.tilt_rad > _LEVEL_RAD:
            self._asked_ns = state.now_ns
            state.level()

    def _give_up(self) -> None:
        state = self._state
        limit_s = state.plan.outage_s
        if limit_s and state.waited(limit_s):
            state.finish(f"waited {limit_s:g} s for {state.absent} in vain, as long as outage_s allows; {state.outage}")
