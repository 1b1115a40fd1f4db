"""`python -m tests.faults.ear RIG ENDPOINT OUT TOPIC…`: an independent listener beside a process; a line a message.

It connects to that process alone and stands on the same side of its cable, so it hears what the process says whatever
becomes of the link.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Any

from shared.bus import Received
from shared.errors import UserError
from shared.messages import MarkerCorners, PlatformState, RunEvent, Sample
from shared.zenoh_bus import ZenohBus
from station.app import assembly
from tests.system.live_rig import tilt_of


def main(rig: str, endpoint: str, out: Path, topics: list[str]) -> None:
    """Listens until it is terminated."""
    with out.open("a", encoding="utf-8") as file:
        while True:
            try:
                _listen(assembly.rig_from(rig).id, endpoint, file, topics)
            except UserError:
                time.sleep(0.2)


def _listen(rig_id: str, endpoint: str, file: Any, topics: list[str]) -> None:
    def hear(received: Received) -> None:
        try:
            message = received.message
        except UserError:
            return
        told = {"t": time.time_ns(), "topic": received.topic, **_told(message)}
        file.write(json.dumps(told) + "\n")

    with ZenohBus(rig_id, connect=[endpoint]) as bus:
        for topic in topics:
            bus.subscribe(topic, hear)
        while True:
            bus.poll(0.05)
            file.flush()


def _told(message: object) -> dict[str, Any]:
    if isinstance(message, MarkerCorners):
        return {"boot": message.boot_id, "seq": message.seq, "at": message.capture_ns}
    if isinstance(message, PlatformState):
        return {"tilt": tilt_of(message)}
    if isinstance(message, RunEvent):
        return {"run": message.run, "phase": message.phase, "reason": message.reason}
    if isinstance(message, Sample):
        return {"run": message.run, "start": message.start_ns, "flags": list(message.flags)}
    return {"text": str(message)}


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], Path(sys.argv[3]), sys.argv[4:])
