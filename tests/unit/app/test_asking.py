"""A service is asked until it answers."""

from __future__ import annotations

from shared.bus import ReplyHandler
from shared.clock import SimulatedClock
from shared.memory_bus import MemoryBus
from shared.messages import ArmReply, ArmStop, Message
from station.app.asking import asked


class _Deaf(MemoryBus):
    """A bus that loses the first requests."""

    lost = 2

    def request(
        self, service: str, message: Message, on_reply: ReplyHandler, *, timeout_s: float = 1.0, direct: bool = False
    ) -> None:
        if self.lost:
            self.lost -= 1
        else:
            super().request(service, message, on_reply, timeout_s=timeout_s, direct=direct)


def test_a_lost_request_is_repeated() -> None:
    """The answer is that of the first request that arrives."""
    bus = _Deaf(SimulatedClock())
    bus.serve("arm/stop", lambda _: ArmReply(accepted=True))
    assert asked(bus, "arm/stop", ArmStop(0, "test"), within_s=30.0) == ArmReply(accepted=True)


def test_silence_is_no_answer() -> None:
    """Nobody serves it: there is no answer when time is up."""
    assert asked(MemoryBus(SimulatedClock()), "arm/stop", ArmStop(0, "test"), within_s=0.1) is None
