"""Rerun's viewer as a page in the browser, from this computer alone: the viewer's program carries the page itself."""

from __future__ import annotations

import subprocess
import time
import urllib.error
import urllib.parse
import urllib.request
from pathlib import Path

from shared.errors import UserError
from shared.system.processes import start
from station.view.viewer import LOOPBACK, binary, free_port

_START_S = 30.0


def serve_file(path: Path) -> tuple[subprocess.Popen[bytes], str]:
    """Serves an .rrd file; gives the process, to be ended by the caller, and the address of the page.

    Raises:
        UserError: if the viewer is not installed or does not start.
    """
    port = free_port()
    return _serve([str(path), "--port", str(port)], port)


def serve_stream(port: int) -> tuple[subprocess.Popen[bytes], str]:
    """Serves the viewer of what another process streams at a port of the loopback address.

    Raises:
        UserError: if the viewer is not installed or does not start.
    """
    return _serve([f"rerun+http://{LOOPBACK}:{port}/proxy"], port)


def _serve(source: list[str], port: int) -> tuple[subprocess.Popen[bytes], str]:
    at = free_port()
    words = [binary(), "--serve-web", "--bind", LOOPBACK, "--web-viewer-port", str(at), *source]
    process = start(words, quiet=True)
    _await(process, f"http://{LOOPBACK}:{at}/")
    query = urllib.parse.urlencode({"url": f"rerun+http://{LOOPBACK}:{port}/proxy"})
    return process, f"http://{LOOPBACK}:{at}/?{query}"


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
