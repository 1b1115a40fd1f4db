"""Rerun's viewer as a page in the browser, from this computer alone: the viewer's program carries the page itself."""

from __future__ import annotations

import socket
import subprocess
import time
import urllib.error
import urllib.parse
import urllib.request
from dataclasses import dataclass
from pathlib import Path

from shared.errors import UserError
from shared.system.processes import ask_to_end, start
from station.view.relay import Relay
from station.view.viewer import LOOPBACK, binary, free_port, kept_here

_START_S = 300.0
"""A viewer that lives may take so long to begin: a busy machine takes minutes. One that has ended is not waited for."""
_OTHER_SITE = "localhost"
"""The name by which a page calls the viewer: another site than the page's own 127.0.0.1, so that the browser gives it a
process of its own, and the page's Stop answers while the viewer is busy drawing."""


@dataclass(frozen=True)
class Served:
    """A viewer's page at `url`, which the caller ends."""

    url: str
    process: subprocess.Popen[bytes]
    relay: Relay

    def end(self) -> None:
        """Ends the page and the program behind it."""
        self.relay.close()
        if self.process.poll() is None:
            ask_to_end(self.process)


def serve_file(path: Path) -> Served:
    """Serves an .rrd file.

    Raises:
        UserError: if the viewer is not installed or does not start.
    """
    port = free_port()
    return _serve([str(path), "--port", str(port)], port)


def serve_stream(streaming: subprocess.Popen[bytes], port: int) -> Served:
    """Serves the viewer of what another process streams at a port of the loopback address, once it does.

    A page that asks before that is refused, does not ask again, and shows the viewer's own welcome for good.

    Raises:
        UserError: if the stream does not begin, or the viewer is not installed or does not start.
    """
    if not _listens(streaming, port):
        raise UserError(f"Expected a view of the session within {_START_S:g} s, but none began")
    return _serve([f"rerun+http://{LOOPBACK}:{port}/proxy"], port)


def _serve(source: list[str], port: int) -> Served:
    at = free_port()
    words = [binary(), "--serve-web", "--bind", LOOPBACK, "--web-viewer-port", str(at), *source]
    process = start(words, quiet=True, env=kept_here())
    _await(process, f"http://{LOOPBACK}:{at}/")
    query = urllib.parse.urlencode({"url": f"rerun+http://{LOOPBACK}:{port}/proxy"})
    relay = Relay(at, data_port=port)
    return Served(f"http://{_OTHER_SITE}:{relay.server_port}/?{query}", process, relay)


def _await(process: subprocess.Popen[bytes], url: str) -> None:
    end = time.monotonic() + _START_S
    while time.monotonic() < end and process.poll() is None:
        try:
            urllib.request.urlopen(url, timeout=1.0).close()
        except (urllib.error.URLError, OSError):
            time.sleep(0.1)
        else:
            return
    raise UserError(f"Expected Rerun's viewer at {url} within {_START_S:g} s, but it did not start")


def _listens(process: subprocess.Popen[bytes], port: int) -> bool:
    """Returns true once somebody listens at the port; False if the process ends before, or takes too long."""
    end = time.monotonic() + _START_S
    while time.monotonic() < end and process.poll() is None:
        try:
            socket.create_connection((LOOPBACK, port), timeout=1.0).close()
        except OSError:
            time.sleep(0.1)
        else:
            return True
    return False
