"""The words of the page of `station serve` in a real browser, without a rig."""

from __future__ import annotations

import json
import shutil
from collections.abc import Generator
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest

from shared.clock import SimulatedClock
from shared.memory_bus import MemoryBus
from station.app import assembly
from station.app.serve.backend import Backend
from station.app.serve.sessions import Files
from station.recording.opening import open_file
from tests.system import chromium
from tests.system.page_without_rig import opened
from tests.unit.diagnosis.recorded import GOLDEN

pytestmark = [
    pytest.mark.system,
    pytest.mark.skipif(not chromium.binary(), reason=chromium.WHY_NOT),
]


@pytest.fixture
def page(tmp_path: Path) -> Generator[chromium.Page]:
    """The page over a folder with one recording, which was copied there."""
    shutil.copyfile(GOLDEN, tmp_path / "golden.mcap")
    bus, rig = MemoryBus(SimulatedClock()), assembly.rig_from(None)
    files = Files(rig=assembly.simulated_rig_path(), plan=None, folder=tmp_path)
    backend = Backend(bus, rig, files=files, clock=SimulatedClock())
    with opened(backend, tmp_path) as shown:
        shown.wait("document.querySelector('#files tr[data-name]')")
        yield shown


def called(page: chromium.Page, function: str, argument: Any) -> str:
    """Returns what a function of the page gives."""
    return str(page.of(f"{function}({json.dumps(argument)})"))


def test_it_says_things_as_people_do(page: chromium.Page) -> None:
    began = datetime.fromtimestamp(1e-9 * open_file(GOLDEN).start_ns)  # local time, as the page has it
    assert page.text("#files tr[data-name] td:nth-child(2)") == f"{began:%Y-%m-%d %H:%M} (simulated)"
    ended = {"own": None, "running": False, "ended": True}
    assert called(page, "phaseOf", ended | {"done": 1}) == "the session has ended with 1 sample"
    assert called(page, "phaseOf", ended | {"done": 2}) == "the session has ended with 2 samples"
    assert called(page, "directionOf", {"direction": 1, "azimuth_deg": 90.0}) == "1 (90°)"
    assert called(page, "directionOf", {"direction": -1, "azimuth_deg": None}) == "free"
    job = {"kind": "doctor", "recording": "sim.mcap", "running": False, "status": 0, "lines": []}
    called(page, "showJob", job)
    assert page.text("#job-title") == "Check of sim.mcap: done"
    assert page.errors == []
