"""A publisher never waits for a link that takes nothing."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import pytest

from shared.foxglove import Log
from shared.messages import PlatformState
from shared.zenoh_bus import ZenohBus
from tests.patience import PATIENCE_S


class _Stuck:
    """A publisher whose link takes nothing until it is freed."""

    def __init__(self) -> None:
        self.free, self.sent = threading.Event(), list[bytes]()

    def put(self, payload: bytes, *, attachment: bytes) -> None:
        assert attachment
        self.free.wait(30.0)
        self.sent.append(payload)

    def undeclare(self) -> None:
        pass


def test_a_message_that_must_arrive_waits_behind_the_publisher(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lines of the log wait for the link; the attitude goes on, and the lines come in their order afterwards."""
    log, attitude = _Stuck(), _Stuck()
    attitude.free.set()
    publishers: dict[str, Any] = {"log": log, "arm/platform": attitude}
    with ZenohBus("waits") as bus:
        monkeypatch.setattr(bus, "_declare_publisher", publishers.__getitem__)
        for text in ("one", "two"):
            bus.publish("log", Log(message=text))
            bus.publish("arm/platform", PlatformState())
        assert len(attitude.sent) == 2
        assert log.sent == []
        log.free.set()
    assert [b"one" in log.sent[0], b"two" in log.sent[1]] == [True, True]


_RECEIVING = """
import socket, time
from pathlib import Path
from shared.zenoh_bus import ZenohBus
with socket.socket() as probe:
    probe.bind(("127.0.0.1", 0))
    at = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
with ZenohBus("threads", listen=[at]) as one, ZenohBus("threads", connect=[at]) as other:
    other.announce("other")
    end = time.monotonic() + 30.0
    while "other" not in one.alive() and time.monotonic() < end:
        time.sleep(0.05)
    names = [task.joinpath("comm").read_text().strip() for task in Path("/proc/self/task").iterdir()]
print(sum(name.startswith("rx-") for name in names))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="Linux alone tells the names of a process's threads")
def test_dead_links_leave_threads_that_receive() -> None:
    """Each dead link may hold one of them for seconds: there are more than a rig has links."""
    clean = {name: value for name, value in os.environ.items() if name != "ZENOH_RUNTIME"}
    root = Path(__file__).parents[3]
    done = subprocess.run(
        [sys.executable, "-c", _RECEIVING],
        env=clean,
        cwd=root,
        capture_output=True,
        text=True,
        check=True,
        timeout=PATIENCE_S,
    )
    assert int(done.stdout) >= 8
