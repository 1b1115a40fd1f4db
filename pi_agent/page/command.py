"""Serves a page for the browser, to set up the camera: focus, exposure, calibration.

It prints a link with a key in it. The page is served to this computer only; to use it on another one, open a tunnel
from there (ssh -L 8788:127.0.0.1:8788 pi@raspberrypi), and then the same link. The camera is one program's at a time:
stop the agent before (sudo systemctl stop pi-agent), and start it again afterwards.
"""

from __future__ import annotations

import argparse
import dataclasses
import threading
import webbrowser
from contextlib import ExitStack
from pathlib import Path

from pi_agent.calibration.kept import Kept, calibrate_and_keep, lens_of
from pi_agent.calibration.lens import BoardSpec
from pi_agent.cameras import CameraContext
from pi_agent.options import add_board, add_rig, rig_of
from pi_agent.page.eye import Eye
from pi_agent.page.server import EyeServer
from shared.clock import SystemClock
from shared.errors import UserError
from shared.page.access import token_of
from shared.rig import RigConfig
from shared.system.desktop import has_display
from shared.system.signals import until_stopped
from shared.zenoh_bus import ZenohBus

EXAMPLE = "pi-agent serve --rig rig.toml"
STOPPED = "0 once it serves"
PORT = 8788
FRAMES = 120
_POLL_S = 0.1


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options of `pi-agent serve`."""
    add_rig(parser)
    add_board(parser)
    add = parser.add_argument
    add("--folder", type=Path, help="where calibration and pictures of the board go (default: the rig file's folder)")
    add("--port", type=int, default=PORT, help="on 127.0.0.1; 0 takes a free one")
    add("--token-file", type=Path, metavar="FILE", help="keep the key here, so that a link outlives a restart")
    add("--no-browser", action="store_true", help="do not open the page")


def run(options: argparse.Namespace) -> int:
    """Serves until Ctrl-C.

    Raises:
        UserError: if the rig file is wrong, or the port or the rig's endpoint is taken.
    """
    rig, board, clock = rig_of(options), BoardSpec.parse(options.board), SystemClock()
    folder = (options.folder or options.rig.parent).resolve()
    if not folder.is_dir():
        raise UserError(f"Expected a folder for the calibration, got {options.folder}")
    token = token_of(options.token_file)
    with ExitStack() as stack:
        stop = stack.enter_context(until_stopped())
        bus = stack.enter_context(_bus(rig, clock))
        context = CameraContext(rig=rig, bus=bus, clock=clock, folder=options.rig.parent)

        def calibrating(exposed: RigConfig, boards: Path | None) -> Kept:
            with_exposure = dataclasses.replace(context, rig=exposed)
            file = folder / "calibration.toml"
            return calibrate_and_keep(with_exposure, file, lens=lens_of(boards, board), frames=FRAMES)

        eye = Eye(context, calibrating=calibrating, boards=folder / "board")
        server = EyeServer(eye, port=options.port, token=token)
        stack.callback(server.close)
        looking = threading.Thread(target=eye.run, args=(stop,), name="camera", daemon=True)
        looking.start()
        threading.Thread(target=server.serve_forever, name="server", daemon=True).start()
        print(f"Camera of rig '{rig.id}'\nOpen in a browser: {server.url}\nCtrl-C ends it.", flush=True)
        if has_display() and not options.no_browser:
            webbrowser.open(server.url)
        while not stop.is_set():
            bus.poll(_POLL_S)
        looking.join(timeout=3.0)
    return 0


def _bus(rig: RigConfig, clock: SystemClock) -> ZenohBus:
    """Returns the rig's bus, over which the synthetic camera hears of the twin.

    Raises:
        UserError: if its endpoint is taken, as it is while the camera agent runs.
    """
    try:
        return ZenohBus.of("camera", rig, clock=clock)
    except UserError as error:
        raise UserError(
            f"{error} (If the camera agent runs, it has the camera: sudo systemctl stop pi-agent, and start it again "
            "afterwards)"
        ) from error
