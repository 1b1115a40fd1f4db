import threading

from pi_agent import outbox
from pi_agent.outbox import Outbox
from shared.bus import Received
from shared.clock import SystemClock
from shared.memory_bus import MemoryBus
from shared.messages import Environment


def test_messages_leave_in_order_and_all_before_the_end():
    bus, stop = MemoryBus(SystemClock()), threading.Event()
    seen: list[Received] = []
    bus.subscribe("environment", seen.append)
    box = Outbox(bus)
    for number in range(100):
        box.put("environment", Environment(stamp_ns=number))
    stop.set()
    box.run(stop)
    assert [received.message for received in seen] == [Environment(stamp_ns=number) for number in range(100)]
    assert len(box) == 0


def test_a_stuck_bus_never_stops_the_camera():
    box = Outbox(MemoryBus(SystemClock()))
    for number in range(outbox.LONGEST + 5):
        box.put("environment", Environment(stamp_ns=number))
    assert (len(box), box.lost) == (outbox.LONGEST, 5)


def test_a_message_that_the_bus_refuses_does_not_silence_the_others():
    bus, stop = MemoryBus(SystemClock()), threading.Event()
    seen: list[Received] = []

    def refuse_the_first(received: Received) -> None:
        if received.message == Environment(stamp_ns=0):
            raise RuntimeError("the session is closed")
        seen.append(received)

    bus.subscribe("environment", refuse_the_first)
    box = Outbox(bus)
    for number in range(3):
        box.put("environment", Environment(stamp_ns=number))
    stop.set()
    box.run(stop)
    assert (len(seen), box.lost) == (2, 1)
