"""The air about the rig as a run has it: an old reading of a thermometer that has died is none."""

from __future__ import annotations

from shared.messages import Environment

HOLDS_S = 60.0
"""A reading holds so long: rooms change by a tenth of a degree in it, which is what such sensors tell apart. They are
to send one a second, so that many may get lost (`pytest tests/unit/sampling/test_air.py`)."""


class Air:
    """The newest reading of the air, and when the station received it."""

    def __init__(self) -> None:
        self._reading = Environment()
        self._taken_ns: int | None = None

    def take(self, reading: Environment, *, now_ns: int) -> bool:
        """Takes a reading; False for one that its own stamp says to be of another time, which is not taken."""
        if abs(now_ns - reading.stamp_ns) > HOLDS_S * 1e9:
            return False
        self._reading, self._taken_ns = reading, now_ns
        return True

    def at(self, time_ns: int) -> Environment | None:
        """Returns the air at a time of the last minutes, by the station's clock; None if nobody measured it then."""
        held = self._taken_ns is not None and abs(time_ns - self._taken_ns) <= HOLDS_S * 1e9
        return self._reading if held else None
