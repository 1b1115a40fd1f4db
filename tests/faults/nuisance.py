"""`python -m tests.faults.nuisance RIG WHAT SECONDS`: a stranger at every port of a rig that has no keys."""

from __future__ import annotations

import contextlib
import itertools
import sys
import time
from collections.abc import Iterator

from shared import topics, wire
from shared.errors import UserError
from shared.foxglove import Log
from shared.zenoh_bus import RawSession
from station.app import assembly

JUNK = b"\xff" * 13
FLOOD_HZ = 3000.0


def main(rig: str, what: str, for_s: float) -> None:
    """Sends for so long."""
    config = assembly.rig_from(rig)
    with contextlib.ExitStack() as stack:
        sessions: list[RawSession] = []
        for name in ("camera", "arm", "twin", "station"):
            with contextlib.suppress(UserError):
                sessions.append(RawSession(connect=list(config.bus.endpoint(name)), mode="peer"))
                stack.callback(sessions[-1].close)
        end = time.monotonic() + for_s
        for session, (name, payload) in zip(itertools.cycle(sessions), itertools.cycle(_sent(what))):
            if time.monotonic() > end:
                break
            session.put(f"repose/{config.id}/{name}", payload)
            if what == "malformed":
                for service in topics.SERVICES:
                    session.query(f"repose/{config.id}/{service}", payload)
            time.sleep(1 / FLOOD_HZ if what == "flood" else 0.02)


def _sent(what: str) -> Iterator[tuple[str, bytes]]:
    if what == "flood":
        yield "log", wire.encode(Log(message="x" * 200, name="stranger"))
        return
    for name, line in topics.TOPICS.items():
        # A newer version has fields that this one does not know (number 900, a text), and topics of its own.
        newer = b"\xa2\x38\x05later" + wire.encode(line.message())
        yield (name, JUNK) if what == "malformed" else (f"{name}/newer", newer)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], float(sys.argv[3]))
