"""The camera's page without a browser: what it measures, what it does, and who is let in."""

from __future__ import annotations

import contextlib
import http.client
import json
import math
import threading
import time
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from pi_agent.calibration.kept import Kept, calibrate_and_keep
from pi_agent.calibration.store import load_calibration
from pi_agent.cameras import CameraContext, Image
from pi_agent.page.edge_width import edge_blur_px, steepness
from pi_agent.page.eye import Eye
from pi_agent.page.light import light_of
from pi_agent.page.server import EyeServer
from pi_agent.synthetic_view import SyntheticOptions, SyntheticView
from shared.clock import SystemClock
from shared.errors import UserError
from shared.memory_bus import MemoryBus
from shared.page.access import HEADER
from shared.rig import RigConfig
from tests.serving import serving
from tests.unit.pi_agent.rigs import FakeTwin, rig, scene

TOKEN = "t" * 43


def picture(*, blur_px: float = 0.7, light: float = 0.9) -> tuple[Image, np.ndarray]:
    options = SyntheticOptions(blur_px=blur_px, light=light)
    view = SyntheticView(rig(), rng=np.random.default_rng(1), options=options)
    return view.frame_and_corners(scene(0.003, -0.002, 0.2), 0)


# --- what is measured ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("blur_px", [0.7, 1.2, 2.0])
def test_the_blur_of_a_marks_edges_is_the_lens_s(blur_px: float) -> None:
    image, corners = picture(blur_px=blur_px)
    assert edge_blur_px(image, corners) == pytest.approx(blur_px, rel=0.1)


def test_no_edge_has_no_blur() -> None:
    flat = np.full((200, 200), 90, dtype=np.uint8)
    assert math.isnan(edge_blur_px(flat, np.array([[50.0, 50.0], [150, 50], [150, 150], [50, 150]])))
    assert steepness(flat) == 0.0


def test_steepness_falls_with_every_turn_out_of_focus() -> None:
    steep = [steepness(picture(blur_px=blur)[0]) for blur in (0.7, 1.2, 2.5)]
    assert steep[0] > 1.1 * steep[1] > 1.1 * 1.1 * steep[2]


@pytest.mark.parametrize(
    ("light", "exposure_ms", "said"),
    [
        (0.9, 2.0, "light is good"),
        (1.6, 2.0, "saturated: shorten"),
        (0.3, 2.0, "lengthen the exposure"),
        (0.3, 9.0, "add light"),
        (0.9, 9.0, "shorten the exposure, add light"),
    ],
)
def test_the_advice_on_light(light: float, exposure_ms: float, said: str) -> None:
    found = light_of(picture(light=light)[0], exposure_ms=exposure_ms, px_per_mm=6.0)
    assert said in found.advice
    assert found.overexposed == ("saturated" in said)
    assert sum(found.histogram) == pytest.approx(1.0)
    assert found.path_px == pytest.approx(0.6 * exposure_ms)


# --- the eye ---------------------------------------------------------------------------------------------------------


@pytest.fixture
def context(tmp_path: Path) -> Generator[CameraContext]:
    clock = SystemClock()
    bus = MemoryBus(clock)
    with FakeTwin(bus, clock):
        yield CameraContext(rig=rig(driver="synthetic"), bus=bus, clock=clock, folder=tmp_path)


@contextlib.contextmanager
def looking(context: CameraContext, calibrating: Callable[[RigConfig, Path | None], Kept]) -> Generator[Eye]:
    eye, stop = Eye(context, calibrating=calibrating, boards=context.folder / "board"), threading.Event()
    thread = threading.Thread(target=eye.run, args=(stop,))
    thread.start()
    try:
        wait(lambda: eye.seen is not None and eye.seen.corners.found)
        yield eye
    finally:
        stop.set()
        thread.join(10)


def wait(happened: Callable[[], bool], *, within_s: float = 60.0) -> None:
    end = time.monotonic() + within_s
    while not happened():
        assert time.monotonic() < end, f"waited {within_s:g} s in vain"
        time.sleep(0.02)


def shape_of(encoded: bytes) -> tuple[int, ...]:
    """The height and width of a picture in a file's form."""
    seen = cv2.imdecode(np.frombuffer(encoded, np.uint8), cv2.IMREAD_GRAYSCALE)
    assert seen is not None
    return seen.shape


def refusing(exposed: RigConfig, boards: Path | None) -> Kept:
    raise UserError(f"Expected a better plate, got {exposed.camera.exposure_ms:g} ms and {boards}")


def test_another_exposure_is_seen_and_nothing_is_written(context: CameraContext) -> None:
    with looking(context, refusing) as eye:
        before = eye.state()["seen"]["light"]
        eye.expose(1.0)
        wait(lambda: eye.state()["seen"]["light"]["white"] < 0.7 * before["white"])
        now = eye.state()
    assert (now["exposure_ms"], now["rig_exposure_ms"]) == (1.0, 2.0)
    assert now["seen"]["light"]["path_px"] == pytest.approx(0.5 * before["path_px"])
    assert list(context.folder.iterdir()) == []


@pytest.mark.parametrize("exposure_ms", [0.0, -1.0, 101.0])
def test_no_camera_exposes_so(context: CameraContext, exposure_ms: float) -> None:
    eye = Eye(context, calibrating=refusing, boards=context.folder / "board")
    with pytest.raises(UserError, match="up to 100 ms"):
        eye.expose(exposure_ms)


def test_a_refused_calibration_is_told_and_pictures_go_on(context: CameraContext) -> None:
    with looking(context, refusing) as eye:
        eye.keep_board()
        eye.calibrate(with_lens=True)
        wait(lambda: not eye.state()["busy"])
        told, seen = eye.state(), eye.seen
        assert told["refused"] == f"Expected a better plate, got 2 ms and {context.folder / 'board'}"
        wait(lambda: eye.seen is not seen)
    assert told["boards"] == 1
    assert shape_of((context.folder / "board" / "board-000.png").read_bytes()) == (600, 600)


def test_a_calibration_is_kept(context: CameraContext) -> None:
    def calibrating(exposed: RigConfig, boards: Path | None) -> Kept:
        assert (exposed, boards) == (context.rig, None)
        file = context.folder / "calibration.toml"
        return calibrate_and_keep(context, file, lens=None, frames=30, with_tone=False)

    with looking(context, calibrating) as eye:
        eye.calibrate(with_lens=False)
        with pytest.raises(UserError, match="wait until it is done"):
            eye.expose(1.0)
        wait(lambda: not eye.state()["busy"])
        told = eye.state()
    assert told["refused"] == ""
    assert "Plate: residuals" in told["notes"]
    assert load_calibration(context.folder / told["file"]).width_px == 600


def test_a_camera_that_cannot_be_had_is_told(tmp_path: Path) -> None:
    clock = SystemClock()
    missing = rig(driver="video_file", options={"path": "none.mp4"})
    context = CameraContext(rig=missing, bus=MemoryBus(clock), clock=clock, folder=tmp_path)
    eye, stop = Eye(context, calibrating=refusing, boards=tmp_path / "board"), threading.Event()
    thread = threading.Thread(target=eye.run, args=(stop,))
    thread.start()
    wait(lambda: "none.mp4" in eye.state()["fault"])
    stop.set()
    thread.join(10)
    with pytest.raises(UserError, match="none has come yet"):
        eye.keep_board()


# --- the server ------------------------------------------------------------------------------------------------------


@pytest.fixture
def server(context: CameraContext) -> Generator[EyeServer]:
    with looking(context, refusing) as eye, serving(EyeServer(eye, port=0, token=TOKEN)) as made:
        yield made


def ask(server: EyeServer, path: str, *, body: Any = None, **headers: str) -> tuple[int, dict[str, str], bytes]:
    """Status, headers and content of an answer; with a `body` it is a POST."""
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=10)
    text = None if body is None else json.dumps(body)
    connection.request("GET" if body is None else "POST", path, body=text, headers=headers)
    answer = connection.getresponse()
    found = answer.status, dict(answer.getheaders()), answer.read()
    connection.close()
    return found


def test_the_pictures_are_for_the_holder_of_the_key(server: EyeServer) -> None:
    known = {"Cookie": f"{server.access.cookie}={TOKEN}"}
    status, headers, data = ask(server, "/picture.jpg?n=1", **known)
    assert (status, headers["Content-Type"]) == (200, "image/jpeg")
    assert shape_of(data) == (600, 600)
    status, headers, data = ask(server, "/mark.png", **known)
    assert (status, headers["Content-Type"]) == (200, "image/png")
    assert shape_of(data)[0] > 200
    assert ask(server, "/calibration.toml", **known)[0] == 404
    for path in ("/", "/picture.jpg", "/mark.png", "/events", "/page.js"):
        assert ask(server, path)[0] == 403
        assert ask(server, path, **known, Host="evil.example")[0] == 421


def test_an_action_needs_our_own_page(server: EyeServer) -> None:
    known = {"Cookie": f"{server.access.cookie}={TOKEN}"}
    body = {"exposure_ms": 1.0}
    assert ask(server, "/do/expose", body=body, **known)[0] == 403
    assert ask(server, "/do/expose", body=body, **known, **{HEADER: TOKEN}, Origin="http://evil")[0] == 403
    assert server.eye.state()["exposure_ms"] == 2.0
    assert ask(server, "/do/expose", body=body, **known, **{HEADER: TOKEN})[0] == 200
    assert server.eye.state()["exposure_ms"] == 1.0


@pytest.mark.parametrize(
    ("path", "body", "said"),
    [
        ("/do/expose", {}, "Expected a number as 'exposure_ms'"),
        ("/do/expose", {"exposure_ms": True}, "Expected a number as 'exposure_ms'"),
        ("/do/expose", {"exposure_ms": 1e9}, "up to 100 ms"),
        ("/do/calibrate", {"lens": "yes"}, "Expected true or false as 'lens'"),
        ("/do/dance", {}, "Expected one of expose, board, calibrate"),
    ],
)
def test_a_wrong_request_is_refused_in_one_sentence(server: EyeServer, path: str, body: Any, said: str) -> None:
    known = {"Cookie": f"{server.access.cookie}={TOKEN}", HEADER: TOKEN}
    status, _, text = ask(server, path, body=body, **known)
    assert status == 409
    assert said in text.decode()
    assert text.count(b"\n") == 1
