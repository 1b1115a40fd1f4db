"""`station serve` in a real browser: a sample arrives, the arm is stopped, and the page outlives the station."""

from __future__ import annotations

import contextlib
import os
import re
import subprocess
import time
from collections.abc import Generator, Sequence
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from shared.bus import Received
from shared.messages import PlatformState
from tests.patience import PATIENCE_S
from tests.system import chromium
from tests.system.elsewhere import elsewhere
from tests.system.live_rig import FAST, Rig, decided_the_same
from tests.system.ports import free_port
from tests.system.processes import end, start

pytestmark = [
    pytest.mark.system,
    pytest.mark.skipif(not chromium.binary(), reason=chromium.WHY_NOT),
]


COMES_TO_REST = 50
"""The polls of a tenth of a second in which a stopped arm must come to rest, also on a busy machine."""
AT_REST_RAD = 1e-4
"""A plate that turns by less in a tenth of a second stands still."""


@contextlib.contextmanager
def served(rig: Rig, *, port: int) -> Generator[tuple[subprocess.Popen[str], str]]:
    """`station serve` for a rig and its folder, with a key that it keeps; the process and the link."""
    plan = rig.folder / "page.toml"
    # Frames come late on a busy machine: fewer failed runs in a row would end the session before its first sample.
    plan.write_text(FAST.format(samples=50, faults=1000, outage_s=0.0), encoding="utf-8")
    words = ("--rig", str(rig.file), "--plan", str(plan), "--port", str(port), "--no-browser")
    process = start("station", "serve", str(rig.folder), *words, "--token-file", str(rig.folder / "key"))
    try:
        yield process, link_of(process)
    finally:
        end(process)


def link_of(process: subprocess.Popen[str]) -> str:
    said = ""
    assert process.stdout is not None
    for line in process.stdout:
        said += line
        if found := re.search(r"http://\S+", line):
            return found[0]
    raise AssertionError(f"it gave no link: {said}")


def moved_rad(rig: Rig, seconds: float) -> float:
    """Returns how far the plate turns once it rests, by the largest change of a component of its attitude."""
    seen = rig.listen("arm/platform")
    for _ in range(COMES_TO_REST):
        first = len(seen)
        rig.bus.poll(0.1)
        if first and len(seen) > first and _turned_rad(seen[first - 1 :]) < AT_REST_RAD:
            break
    first = len(seen)
    while len(seen) < first + 100 * seconds:
        rig.bus.poll(0.05)
    return _turned_rad(seen[first:])


def _turned_rad(seen: Sequence[Received]) -> float:
    states = [item.message for item in seen if isinstance(item.message, PlatformState)]
    return max(max(abs(one.qx - states[0].qx), abs(one.qy - states[0].qy)) for one in states)


def test_a_session_on_the_page(rig: Rig, tmp_path: Path) -> None:
    port = free_port()
    with chromium.browser(tmp_path / "profile") as page:
        with served(rig, port=port) as (_, link):
            page.size(1280, 1000)
            page.open(link)
            assert page.of("location.search") == "", "the key stays in the address"
            page.wait("document.getElementById('link').innerText === 'connected'")
            page.wait("document.getElementById('notes').innerText.includes('camera sags')")
            page.of("document.getElementById('samples').value = 50")
            page.click("#start")
            page.wait("document.querySelector('#runs tbody tr')")
            assert "camera" in page.text("#health")
            assert "of 50" in page.text("#done")
            page.wait("document.querySelector('#curve .run')")

            page.click("#pause")
            page.wait("/pausing|paused/.test(document.getElementById('state').innerText)")
            page.click("#pause")
            page.wait("!/pausing|paused/.test(document.getElementById('state').innerText)")

            rig.wait("a tilt", rig.tilting, running="")
            page.click("#emergency")
            page.wait("document.getElementById('said').innerText.includes('stopped where it is')")
            assert moved_rad(rig, 1.0) < 1e-3
            page.wait("document.getElementById('health').innerText.includes('emergency stop on the page')")
            page.wait("document.getElementById('state').innerText.includes('ended with')")
            assert moved_rad(rig, LEVELS_AFTER_S) < 1e-3, "a stopped plate went to level as its session ended"
            page.wait("document.querySelector('#files tr[data-name$=mcap]')")
        page.wait("document.getElementById('link').className === 'lost'")
        (recorded,) = (rig.folder / "recordings").glob("*.mcap")
        assert decided_the_same(recorded), "a pause is a part of the recording"

        with served(rig, port=port):
            page.wait("document.getElementById('link').innerText === 'connected'")
            page.wait("document.getElementById('state').innerText === 'no session'")
            page.click("#start")
            page.wait("document.getElementById('state').innerText.startsWith('run 1')")
            assert page.of("document.querySelectorAll('#runs tbody tr').length") == 0
            page.click("#stop")
            page.wait("!document.getElementById('start').disabled")
            page.wait("document.getElementById('state').innerText.includes('has ended with')")
            page.wait("!document.querySelector('#health .bad')")
    unexpected = [error for error in page.errors if "ERR_CONNECTION_REFUSED" not in error]
    assert not unexpected


def test_the_session_is_seen_in_rerun_as_it_runs(rig: Rig, tmp_path: Path) -> None:
    """Rerun's own page draws what the rig does, and Stop answers while it draws."""
    with (
        elsewhere() as internet,
        chromium.browser(tmp_path / "profile", internet.word, *chromium.DRAWS_WITHOUT_A_CARD) as page,
        served(rig, port=free_port()) as (_, link),
    ):
        page.size(900, 700)
        page.open(link)
        page.wait("document.getElementById('link').innerText === 'connected'")
        page.of(f"document.getElementById('samples').value = {NEVER_DONE}")
        page.click("#start")
        page.wait("document.getElementById('state').innerText.startsWith('run 1')")
        page.click("#view-live")
        page.wait("document.getElementById('frame').src.startsWith('http://localhost:')")
        page.of("document.getElementById('frame').scrollIntoView()")
        before = look(page, tmp_path / "rerun.png")
        end = time.monotonic() + PATIENCE_S
        while not shows_a_camera(now := look(page, tmp_path / "rerun.png")) or changed(before, now) < MOVING:
            assert time.monotonic() < end, f"the viewer shows nothing that moves: {page.errors}"
            before = now
        while_drawing = list(page.errors)  # the session's end cuts the viewer's stream, which may be told as an error
        page.click("#stop")
        page.wait("!document.getElementById('start').disabled")
    assert internet.asked == [], "the page works without the internet, and asks nobody there"
    assert not [error for error in while_drawing if "127.0.0.1" in error and "proxy" in error.lower()], while_drawing


LEVELS_AFTER_S = 8.0
"""An arm that hears no station levels after 6 s (`heartbeat_timeout_s` and `level_after_s`), if no stop is in force."""
NEVER_DONE = 10_000
"""Samples that a test does not live to see: without a graphics card the viewer takes minutes on a busy machine."""
MOVING = 0.01
"""The share of the viewer's pixels that change from one look to the next."""
ON_THE_PLATE, TEXTURE = (slice(195, 245), slice(50, 180)), 5.0
"""A place in the camera's picture, and the least deviation of its grey levels. Rerun's welcome, which fades and so
changes as well, is empty there."""


def look(page: chromium.Page, file: Path) -> NDArray[np.int16]:
    """The picture of the viewer, without the page about it; kept where REPOSE_PICTURES says, to be looked at."""
    file = Path(os.environ.get("REPOSE_PICTURES", file.parent)) / file.name
    time.sleep(3.0)
    page.picture(file)
    seen = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
    assert seen is not None
    return seen[150:, 60:840].astype(np.int16)


def shows_a_camera(seen: NDArray[np.int16]) -> bool:
    return float(seen[ON_THE_PLATE].std()) > TEXTURE


def changed(one: NDArray[np.int16], other: NDArray[np.int16]) -> float:
    return float(np.mean(np.abs(one - other) > 12))
