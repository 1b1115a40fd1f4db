"""The agents' clocks against the station's: stamps of an agent whose clock is not known now have no station time."""

from __future__ import annotations

import math

from shared.messages import ClockOffset
from station.sampling.clock_step import STEP_NS, is_another_clock

AGENTS = ("camera", "arm")
_DRIFT = 200e-6
"""The largest drift of a clock against another: 200 ppm, twice what a quartz is allowed."""
_EVERY_S = 2.0
"""The sigma of an offset holds until the next one is due: they come once a second, and one may get lost."""
_HOLDS_S = STEP_NS * 1e-9 / _DRIFT
"""An offset tells nothing of a clock later than this, 10 s: by then it may have drifted as far as makes another clock
(`pytest tests/unit/sampling/test_clocks.py`)."""


class Clocks:
    """The newest measured offset of each agent's clock, and when the station received it."""

    def __init__(self) -> None:
        self._offsets: dict[str, tuple[ClockOffset, int]] = {}

    def take(self, message: ClockOffset, *, now_ns: int) -> bool:
        """Takes a new measurement of an agent's clock; True if it cannot be the clock that was measured before."""
        before, _ = self._offsets.get(message.agent, (message, 0))
        self._offsets[message.agent] = message, now_ns
        round_trips_ns = before.rtt_ns + message.rtt_ns
        return is_another_clock(before.offset_ns, message.offset_ns, round_trips_ns=round_trips_ns)

    def offset_ns(self, agent: str, *, now_ns: int) -> int | None:
        """Returns station minus agent clock, ns; None while that clock is not known."""
        message, taken_ns = self._offsets.get(agent, (None, 0))
        held = message is not None and (now_ns - taken_ns) * 1e-9 <= _HOLDS_S
        return message.offset_ns if message is not None and held else None

    def unknown(self, *, now_ns: int) -> tuple[str, ...]:
        """Returns the agents whose clocks are not known now."""
        return tuple(agent for agent in AGENTS if self.offset_ns(agent, now_ns=now_ns) is None)

    def sigma_s(self, *, now_ns: int) -> float:
        """Returns the standard error of the time between stamps of all agents, which grows as their offsets age."""
        return math.hypot(*(self._sigma_s(message, taken_ns, now_ns) for message, taken_ns in self._offsets.values()))

    def _sigma_s(self, message: ClockOffset, taken_ns: int, now_ns: int) -> float:
        drifted_s = _DRIFT * max((now_ns - taken_ns) * 1e-9 - _EVERY_S, 0.0)
        return math.hypot(message.sigma_ns * 1e-9, drifted_s)
