"""The page of `station serve` in a real browser, without a rig: what it shows when nothing moves but the page."""

from __future__ import annotations

import threading
from collections.abc import Generator
from pathlib import Path
from unittest.mock import Mock

import pytest

from shared.bus import Received
from shared.clock import SimulatedClock
from shared.memory_bus import MemoryBus
from shared.messages import Sample, SessionStatus
from station.app import assembly
from station.app.serve.backend import Backend
from station.app.serve.jobs import Program
from station.app.serve.sessions import Files
from tests.system import chromium
from tests.system.page_without_rig import opened

pytestmark = [pytest.mark.system, pytest.mark.skipif(not chromium.binary(), reason=chromium.WHY_NOT)]


@pytest.fixture
def backend(tmp_path: Path) -> Backend:
    clock, folder = SimulatedClock(), tmp_path / "recordings"
    folder.mkdir()
    (folder / "one.mcap").write_bytes(b"1234")
    files = Files(rig=assembly.simulated_rig_path(), plan=None, folder=folder)
    return Backend(MemoryBus(clock), assembly.rig_from(None), files=files, clock=clock)


@pytest.fixture
def page(backend: Backend, tmp_path: Path) -> Generator[chromium.Page]:
    with opened(backend, tmp_path) as shown:
        shown.wait("document.getElementById('link').innerText === 'connected'")
        yield shown


def test_a_session_that_is_started_again_begins_empty(
    page: chromium.Page, backend: Backend, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It showed "20 of 20", the old dots and table, and parts that were silent "as the session has ended"."""
    backend.follower.take(Received("session/status", 1, SessionStatus(recording="a.mcap", total=1)))
    backend.follower.take(Received("session/sample", 2, Sample(run=1, onset_angle_rad=0.3)))
    page.wait("document.querySelector('#runs tbody tr')")
    page.wait("document.getElementById('health').innerText.includes('has ended')")
    monkeypatch.setattr(Program, "begin", Mock())
    monkeypatch.setattr(Program, "runs", True)
    page.click("#start")
    page.wait("document.getElementById('state').innerText === 'starting'")
    page.wait("document.querySelectorAll('#runs tbody tr').length === 0")
    assert page.text("#done") == "0"
    assert "has ended" not in page.text("#health")
    assert not page.of("document.querySelector('#health .bad')")


class Work(Program):
    """Work that lasts until it is said to be over."""

    over = threading.Event()

    @property
    def runs(self) -> bool:
        return not self.over.is_set()


def test_work_that_was_refused_says_so_until_the_other_has_ended(page: chromium.Page, backend: Backend) -> None:
    work = Work(["doctor"], recording="one.mcap", kind="doctor")
    backend.jobs.newest = work
    page.wait("document.getElementById('job-title').innerText.includes('running')")
    page.click("#files tr[data-name='one.mcap'] button:nth-of-type(2)")
    page.wait("document.getElementById('said').innerText.includes('one command at a time')")
    work.over.set()
    page.wait("!document.getElementById('job-title').innerText.includes('running')")
    assert page.of("document.getElementById('said').hidden")


@pytest.mark.parametrize("width", [390, 900, 1280])
def test_no_card_leaves_a_part_of_its_row_empty(width: int, page: chromium.Page) -> None:
    """With two columns the third card stood beside nothing."""
    page.size(width, 900)
    ends = page.of(
        "Array.from(document.querySelectorAll('main > section:not([hidden])'), "
        "(one) => { const box = one.getBoundingClientRect(); return [box.top, box.right]; })"
    )
    rows = {top: max(right for above, right in ends if above == top) for top, _ in ends}
    assert max(rows.values()) - min(rows.values()) < 1.0, rows
