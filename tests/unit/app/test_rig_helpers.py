"""`station rig` begins when the rig's other processes are on the bus, however long they take."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Generator

import pytest

from shared.errors import UserError
from station.app import assembly
from station.app.commands import rig

RIG = assembly.rig_from(None)


class SlowBus:
    """One more process is on the bus each time that somebody listens."""

    def __init__(self) -> None:
        self.heard = 0

    def __enter__(self) -> SlowBus:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def alive(self) -> set[str]:
        return {"view", *sorted(rig.HELPERS)[: self.heard]}

    def poll(self, _timeout_s: float) -> None:
        self.heard += 1


@pytest.fixture
def bus(monkeypatch: pytest.MonkeyPatch) -> SlowBus:
    slow = SlowBus()

    def opened(*_: object, **__: object) -> SlowBus:
        return slow

    monkeypatch.setattr(rig.ZenohBus, "of", opened)
    return slow


@pytest.fixture
def helper() -> Generator[subprocess.Popen[bytes]]:
    """A process that goes on until it is ended."""
    process = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
    yield process
    process.kill()
    process.wait()


def test_it_waits_until_all_are_there_and_no_longer(bus: SlowBus, helper: subprocess.Popen[bytes]) -> None:
    rig.await_helpers(RIG, [helper])
    assert bus.heard == len(rig.HELPERS)


def test_one_that_ended_by_itself_is_named_at_once(bus: SlowBus, helper: subprocess.Popen[bytes]) -> None:
    helper.kill()
    helper.wait()
    with pytest.raises(UserError, match="ended by itself with status"):
        rig.await_helpers(RIG, [helper])
    assert bus.heard == 0
