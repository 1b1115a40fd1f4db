"""`pi-agent serve` in a real browser, with the synthetic camera: focus, light, an exposure, a calibration."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Generator
from pathlib import Path

import pytest

from shared.clock import SystemClock
from shared.zenoh_bus import ZenohBus
from tests.system import chromium
from tests.system.ports import free_port
from tests.system.processes import end, start
from tests.system.test_page import link_of
from tests.unit.pi_agent.rigs import FakeTwin, scene

pytestmark = [
    pytest.mark.system,
    pytest.mark.skipif(not chromium.binary(), reason=chromium.WHY_NOT),
]
RIG = """\
id = "system-{port}"
[bus]
camera = "tcp/127.0.0.1:{port}"
arm = ""
station = ""
[mark]
side_mm = 7.5
margin = 0.16
[camera]
driver = "synthetic"
"""


@pytest.fixture
def link(tmp_path: Path) -> Generator[str]:
    """The page of a camera that sees a played twin's block at rest."""
    port, clock = free_port(), SystemClock()
    file = tmp_path / "rig.toml"
    file.write_text(RIG.format(port=port), encoding="utf-8")
    words = ("--rig", str(file), "--port", str(free_port()), "--no-browser")
    process: subprocess.Popen[str] = start("pi_agent", "serve", *words)
    bus = ZenohBus(f"system-{port}", connect=[f"tcp/127.0.0.1:{port}"], clock=clock)
    try:
        with FakeTwin(bus, clock, lambda _: scene(0.001, -0.001, 0.1)):
            yield link_of(process)
    finally:
        end(process)
        bus.close()


def test_a_camera_is_set_up_on_the_page(link: str, tmp_path: Path) -> None:
    with chromium.browser(tmp_path / "profile") as page:
        page.size(1280, 1000)
        page.open(link)
        assert page.of("location.search") == "", "the key stays in the address"
        page.wait("document.getElementById('fault').innerText.startsWith('The mark is found')")
        page.wait("document.getElementById('picture').naturalWidth === 600")
        page.wait("document.querySelectorAll('#marks polygon').length === 5")
        page.wait("/blur 0[.][678]/.test(document.getElementById('blur').innerText)")
        page.wait("document.getElementById('advice').innerText === 'The light is good.'")
        page.picture(_out(tmp_path) / "camera-page.png", whole=True)

        page.of("document.getElementById('exposure').value = 0.5")
        page.click("#expose button")
        page.wait("document.getElementById('advice').innerText.includes('lengthen the exposure')")
        assert "exposure_ms = 0.5 under [camera]" in page.text("#keep")
        page.of("document.getElementById('exposure').value = 2")
        page.click("#expose button")
        page.wait("document.getElementById('advice').innerText === 'The light is good.'")

        page.click("#board")
        page.wait("document.getElementById('boards').innerText === '1'")
        page.click("#start")
        page.wait("document.getElementById('start').disabled")
        page.wait("document.getElementById('notes').innerText.includes('Plate: residuals')")
        page.wait("document.getElementById('drawn').naturalWidth > 600")
        assert page.of("fetch('/calibration.toml').then((answer) => answer.text())").count("plate_from_pixel") == 1
        assert (tmp_path / "calibration.toml").exists()
        page.wait("document.getElementById('fault').innerText.startsWith('The mark is found')")

        page.size(390, 844, phone=True, dark=True)
        assert page.of("document.documentElement.scrollWidth") <= 390, "a phone would scroll sideways"
        page.picture(_out(tmp_path) / "camera-phone.png", whole=True)
    assert page.errors == []


def _out(folder: Path) -> Path:
    """The folder that screenshots go to, to be looked at: REPOSE_PICTURES, or the test's own."""
    return Path(os.environ.get("REPOSE_PICTURES", folder))
