"""The words of the page of `station serve` in a real browser, without a rig."""

from __future__ import annotations

import json
import math
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
    # In one call, as the page shows the station's own job again with each state that it takes.
    shown = page.of(f"(showJob({json.dumps(job)}), document.querySelector('#job-title').innerText)")
    assert shown == "Check of sim.mcap: done"
    assert page.errors == []


COVERED = """(curve) => {
showCurve(curve);
const line = document.querySelector("#curve .fit"), dots = [...document.querySelectorAll("#curve .run")];
const seen = dots.map((dot) => [+dot.getAttribute("cx"), +dot.getAttribute("cy")]);
for (let at = 0; at < line.getTotalLength(); at += 0.5) {
    const { x, y } = line.getPointAtLength(at);
    seen.push([x, y]);
}
const boxes = [...document.querySelectorAll("#curve text")].map((text) => text.getBBox());
const on = (box) => ([x, y]) => box.x < x && x < box.x + box.width && box.y < y && y < box.y + box.height;
return { numbers: boxes.length, covered: boxes.filter((box) => seen.some(on(box))).length }; }"""
"""Draws a curve, and counts the rings' numbers and those of them that lie on the curve or on a dot.

It is one call, as the page may draw the curve that the station sends between two.
"""


@pytest.mark.parametrize("mu", [0.35, 0.38, 0.4, 0.41])
def test_no_number_of_a_ring_lies_on_the_curve_or_on_a_dot(mu: float, page: chromium.Page) -> None:
    """The dots lie where the plate tilts, and the numbers stood on the upper of these axes."""
    circle = [[math.radians(5 * step), mu] for step in range(73)]
    dots = [[math.radians(90 * way + jitter), mu + 0.01 * jitter, False] for way in range(4) for jitter in range(-5, 6)]
    seen = page.of(f"({COVERED})({json.dumps({'points': dots, 'curve': circle})})")
    assert seen["numbers"] > 1
    assert seen["covered"] == 0
