"""The Rerun viewer: where its binary is, opening it, and taking pictures without a display."""

from __future__ import annotations

import os
import socket
import subprocess
import time
from collections.abc import Generator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from shared.errors import UserError
from shared.installed import to_install
from shared.system.desktop import PROGRAM_SUFFIX
from shared.system.processes import start
from station.view.entities import ELAPSED

if TYPE_CHECKING:
    from rerun.experimental import ViewerClient

LOOPBACK = "127.0.0.1"
_DISCARD = 9
"""The port on which nothing is answered (RFC 863), if anybody listens there at all."""
_DRIVERS = Path("/usr/share/vulkan/icd.d")
_START_S, _LOAD_S, _SETTLE_S = 60.0, 60.0, 1.0
_PICTURE_TRIES = 6
"""The viewer gives up on a picture after some seconds, which a software renderer on a busy machine may need."""
_BAR_PX = 37
"""The height of the window's own bar: a menu, and warnings about the graphics driver of a machine without a display
(`pytest tests/unit/view/test_viewer.py -k own_bar`)."""


def kept_here() -> dict[str, str]:
    """Returns the environment in which the viewer's program reaches nobody but this computer.

    It sends usage figures by whatever HTTPS_PROXY names (`tests/system/test_viewer_page.py` hears it), and has no
    other switch than one that is the user's to set, `rerun analytics disable`.
    """
    nobody, own = f"http://{LOOPBACK}:{_DISCARD}", f"{LOOPBACK},localhost"
    proxies = dict.fromkeys(("HTTPS_PROXY", "HTTP_PROXY", "ALL_PROXY"), nobody) | {"NO_PROXY": own}
    return {**os.environ, **proxies, **{name.lower(): value for name, value in proxies.items()}}


def can_draw_headless() -> bool:
    """Returns true if pictures can be drawn without a display.

    Mesa's software renderer draws them, or what VK_ICD_FILENAMES names.
    """
    return bool(_software_renderer()) or "VK_ICD_FILENAMES" in os.environ


def _software_renderer() -> str:
    """Returns the driver file of Mesa's software renderer, whose name has the processor's in it."""
    return next((str(path) for path in sorted(_DRIVERS.glob("lvp_icd*.json"))), "")


def binary() -> str:
    """Returns the viewer that came with this environment.

    It is the program itself, because the script in bin/ leaves it behind.

    Raises:
        UserError: if it is not installed.
    """
    spec = find_spec("rerun_cli")
    for folder in (spec.submodule_search_locations or []) if spec else []:
        if (path := Path(folder) / f"rerun{PROGRAM_SUFFIX}").exists():
            return str(path)
    raise UserError(f"Expected the Rerun viewer beside this program, but it is missing; run: {to_install('view')}")


def open_file(path: Path) -> None:
    """Opens a file in a viewer of its own, which outlives this process."""
    start((binary(), "--bind", LOOPBACK, "--port", "auto", str(path)), quiet=True)


def open_stream(uri: str) -> None:
    """Opens a viewer on what is being served at `uri`; it outlives this process."""
    start((binary(), "--bind", LOOPBACK, "--port", "auto", "--connect", uri), quiet=True)


def free_port(first: int = 0) -> int:
    """Returns a port of the loopback address that nobody listens on: `first` if it is free."""
    for port in (first, 0):
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind((LOOPBACK, port))
            except OSError:
                continue
            return int(probe.getsockname()[1])
    raise UserError(f"Expected a free port on {LOOPBACK}, but there is none")


@contextmanager
def headless(*, size: tuple[int, int] = (1600, 1000)) -> Generator[ViewerClient]:
    """Runs a viewer without a window, on the loopback address; it ends on leaving.

    Raises:
        UserError: if it cannot draw here.
    """
    if not can_draw_headless():
        raise UserError(
            "Expected a Vulkan renderer for a picture without a display, but there is none; "
            "on Debian or Ubuntu, run: apt-get install mesa-vulkan-drivers"
        )
    port = free_port()
    environment = {"VK_ICD_FILENAMES": _software_renderer(), "RUST_LOG": "error", **kept_here()}
    words = [binary(), "--headless", "--renderer", "vulkan", "--bind", LOOPBACK, "--port", str(port)]
    words += ["--window-size", f"{size[0]}x{size[1]}"]
    process = start(words, quiet=True, env=environment)
    try:
        yield _connect(process, port)
    finally:
        process.kill()
        process.wait()


def _connect(process: subprocess.Popen[bytes], port: int) -> ViewerClient:
    from rerun.experimental import ViewerClient  # noqa: PLC0415  # a rig without a window goes without this package

    end = time.monotonic() + _START_S
    while time.monotonic() < end and process.poll() is None:
        try:
            client = ViewerClient.connect(f"rerun+http://{LOOPBACK}:{port}/proxy")
            client.get_state()
        except (ConnectionError, RuntimeError, TimeoutError):  # not listening yet, or not answering yet
            time.sleep(0.1)
        else:
            return client
    raise UserError(
        f"Expected Rerun's headless viewer to start within {_START_S:g} s, but it did not (status {process.poll()}); "
        "is the Vulkan driver that VK_ICD_FILENAMES names whole?"
    )


def show(client: ViewerClient, path: Path, *, at_s: float | None = None) -> Any:
    """Loads a file, moves to `at_s` seconds after its start (None: its end, if it has times); gives the viewer's state.

    Raises:
        UserError: if the file does not appear.
    """
    client.open(str(path.resolve()))
    end = time.monotonic() + _LOAD_S
    state = client.get_state()
    while time.monotonic() < end and not _loaded(state):
        time.sleep(0.2)
        state = client.get_state()
    if not state.recordings:
        raise UserError(f"Expected the viewer to show {path}, but it did not load within {_LOAD_S:g} s")
    if at_s is None:
        lines = [line for recording in state.recordings for line in recording.timelines if line.name == ELAPSED]
        at_s = max(line.end or 0 for line in lines) * 1e-9 if lines else None
    if at_s is not None:
        move_to(client, at_s)
    time.sleep(_SETTLE_S)  # the views are laid out and drawn over several frames
    return client.get_state()


def move_to(client: ViewerClient, at_s: float) -> None:
    """Shows another moment, in seconds after the start of what is shown."""
    client.set_time(ELAPSED, duration=at_s, play_state="paused")


def _loaded(state: Any) -> bool:
    return bool(state.recordings) and bool(state.views) and not state.loading


def picture_of(client: ViewerClient, view_id: str | None = None) -> bytes:
    """Returns the viewer's picture as a PNG: the whole window, or one view.

    Raises:
        UserError: if it does not draw in time, asked again and again.
    """
    for _ in range(_PICTURE_TRIES):
        try:
            return client.take_screenshot(view_id)
        except TimeoutError:
            time.sleep(_SETTLE_S)
    raise UserError("Expected a picture from Rerun's headless viewer, but it draws none in time; is the machine busy?")


def without_bar(picture: bytes) -> bytes:
    """Returns the window's picture (PNG) without its own bar, which shows nothing of a recording."""
    import cv2  # noqa: PLC0415  # opening a viewer starts without this package

    pixels = cv2.imdecode(np.frombuffer(picture, dtype=np.uint8), cv2.IMREAD_UNCHANGED)
    if pixels is None:
        raise UserError("Expected a PNG from Rerun's headless viewer, but its picture cannot be read")
    return cv2.imencode(".png", pixels[_BAR_PX:])[1].tobytes()


def screenshot(path: Path, out: Path, *, at_s: float | None = None) -> list[str]:
    """Draws a file as the viewer shows it into a PNG; gives what the views complained of.

    Raises:
        UserError: if it cannot be drawn here or `out` cannot be written.
    """
    with headless() as client:
        state = show(client, path, at_s=at_s)
        picture = picture_of(client)
    try:
        out.write_bytes(without_bar(picture))
    except OSError as error:
        raise UserError(
            f"Expected to write the picture to {out}, but it cannot be written: {error.strerror}"
        ) from error
    return [f"{view.name}: {report.summary}" for view in state.views for report in view.reports]
