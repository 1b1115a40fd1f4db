"""Serves a page for the browser: the running session, start, pause, stop, emergency stop, and the recordings here.

It prints a link with a key in it; who opens another one sees nothing. The page is served to this computer only; from
another one, open a tunnel: ssh -L 8787:127.0.0.1:8787 THIS_MACHINE, and the same link there. Sessions that were
started with `station run` are shown as well and go on when this ends; one that the page has started ends with it, the
plate level.
"""

from __future__ import annotations

import argparse
import threading
import webbrowser
from contextlib import ExitStack
from pathlib import Path

from shared.bus_rights import OBSERVER
from shared.clock import SystemClock
from shared.errors import UserError
from shared.page.access import token_of
from shared.system.desktop import has_display
from shared.system.signals import until_stopped
from shared.zenoh_bus import ZenohBus
from station.app import assembly
from station.app.serve.backend import Backend
from station.app.serve.server import PageServer
from station.app.serve.sessions import Files

NAME = "serve"
HELP = "a page in the browser: the running session with its controls, and the recordings of a folder"
EXAMPLE = "station serve --rig rig.toml"
STOPPED = "0 once it serves"
PORT = 8787
_POLL_S = 0.1


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument("folder", type=Path, nargs="?", default=Path(), help="where the recordings lie")
    parser.add_argument("--rig", help="rig file; without it the simulated rig that comes with Repose")
    parser.add_argument("--plan", help="plan of the sessions that the page starts; without it the paper's values")
    parser.add_argument("--port", type=int, default=PORT, help="on 127.0.0.1; 0 takes a free one")
    parser.add_argument(
        "--token-file", type=Path, metavar="FILE", help="keep the key here, so that a link outlives a restart"
    )
    parser.add_argument("--no-browser", action="store_true", help="do not open the page")


def run(options: argparse.Namespace) -> int:
    """Serves until it is stopped; 0."""
    rig_file = Path(options.rig) if options.rig else assembly.simulated_rig_path()
    rig, folder, clock = assembly.rig_from(options.rig), options.folder.resolve(), SystemClock()
    if not folder.is_dir():
        raise UserError(f"Expected a folder with recordings, got {options.folder}")
    assembly.plan_from(options.plan, samples=None, seed=None)  # a mistake in it is told before anybody presses Start
    files = Files(rig=rig_file.resolve(), plan=Path(options.plan).resolve() if options.plan else None, folder=folder)
    token = token_of(options.token_file)
    with ExitStack() as stack:
        stopped = stack.enter_context(until_stopped())
        bus = stack.enter_context(ZenohBus.of(OBSERVER, rig, clock=clock))
        backend = Backend(bus, rig, files=files, clock=clock)
        stack.callback(backend.close)
        server = PageServer(backend, port=options.port, token=token)
        stack.callback(server.close)
        threading.Thread(target=server.serve_forever, name="server", daemon=True).start()
        print(f"Rig '{rig.id}', recordings of {folder}\nOpen in a browser: {server.url}\nCtrl-C ends it.", flush=True)
        if has_display() and not options.no_browser:
            webbrowser.open(server.url)
        while not stopped.is_set():
            bus.poll(_POLL_S)
    return 0
