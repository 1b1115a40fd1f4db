"""Measures the offsets of the agents' clocks from the station's by round trips, of which only the quickest count.

The answer comes in the middle of the round trip at best, so the error is at most half of it: 20 µs on the best 5 % of
round trips, milliseconds on the others.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from shared.bus import Bus
from shared.clock import Clock
from shared.messages import ClockOffset, ClockPing, ClockPong, Message
from station.sampling.clock_step import is_another_clock

PING_NS = 50_000_000
ANSWER_S = 0.5
"""A longer round trip tells nothing: half of it is the most that an offset may be off, and frames that are a second old
count as fresh. An agent that has not answered yet is not asked again: it would answer nothing else."""
REPORT_NS = 1_000_000_000
WINDOW = 200
WINDOW_NS = WINDOW * PING_NS
"""Older round trips say too little of the clock now: it may have drifted by 2 ms since (200 ppm)."""
LEAST_TRIPS = 6
"""Round trips before the first report: a single one may be milliseconds off."""


@dataclass(frozen=True, slots=True)
class RoundTrip:
    """One ping: station minus agent clock, how long it took, and when it was back."""

    offset_ns: int
    rtt_ns: int
    back_ns: int = 0


def best_of(trips: Collection[RoundTrip]) -> tuple[RoundTrip, int]:
    """Returns the quickest round trip, and the standard error (ns) that its length allows (uniform over ± rtt/2)."""
    best = min(trips, key=lambda trip: trip.rtt_ns)
    return best, round(best.rtt_ns / 12**0.5)


class ClockKeeper:
    """Pings each agent up to twenty times a second, and publishes a ClockOffset for each once a second."""

    def __init__(self, bus: Bus, *, clock: Clock, agents: tuple[str, ...]) -> None:
        self._bus, self._clock = bus, clock
        self._trips = {agent: deque[RoundTrip](maxlen=WINDOW) for agent in agents}
        self._ping_ns = 0
        self._again_ns = dict[str, int]()
        self._report_ns: dict[str, int] = {}

    def tick(self, now_ns: int) -> None:
        """Sends the pings and reports that are due."""
        if now_ns >= self._ping_ns:
            self._ping_ns = now_ns + PING_NS
            for agent in self._trips:
                if now_ns >= self._again_ns.get(agent, 0):
                    self._ping(agent)
        for agent, trips in self._trips.items():
            if now_ns >= self._report_ns.get(agent, 0):
                # A copy, because the answers come on another thread.
                self._report(agent, [trip for trip in tuple(trips) if now_ns - trip.back_ns <= WINDOW_NS], now_ns)

    def _ping(self, agent: str) -> None:
        sent_ns = self._clock.now_ns()
        # The bus itself says when nobody has answered in time; should that get lost, the agent is asked again.
        self._again_ns[agent] = sent_ns + 2 * round(ANSWER_S * 1e9)

        def on_reply(reply: Message | None) -> None:
            back_ns = self._clock.now_ns()
            self._again_ns[agent] = 0
            if isinstance(reply, ClockPong):
                middle = (sent_ns + back_ns) // 2
                self._take(agent, RoundTrip(middle - reply.agent_ns, back_ns - sent_ns, back_ns))

        # Answered on the receiving thread: waiting in the queue would count as travel.
        self._bus.request(f"{agent}/clock", ClockPing(station_ns=sent_ns), on_reply, timeout_s=ANSWER_S, direct=True)

    def _take(self, agent: str, trip: RoundTrip) -> None:
        """Keeps a round trip; those before it are forgotten if that clock cannot be the one that they measured."""
        trips = self._trips[agent]
        if trips:
            best, _ = best_of(tuple(trips))
            if is_another_clock(best.offset_ns, trip.offset_ns, round_trips_ns=trip.rtt_ns + best.rtt_ns):
                # An agent that was started again, or whose clock was set: old offsets would misplace its stamps.
                self._trips[agent] = trips = deque[RoundTrip](maxlen=WINDOW)
        trips.append(trip)

    def _report(self, agent: str, trips: Sequence[RoundTrip], now_ns: int) -> None:
        if len(trips) < LEAST_TRIPS:
            return
        self._report_ns[agent] = now_ns + REPORT_NS
        best, sigma_ns = best_of(trips)
        self._bus.publish("clock", ClockOffset(now_ns, agent, best.offset_ns, sigma_ns, best.rtt_ns))
