"""Rerun's viewer in the browser, for a recording or for the session that runs."""

from __future__ import annotations

import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from shared.errors import UserError
from shared.system.processes import ask_to_end, start
from station.view import viewer
from station.view.web import serve_file, serve_stream

LIVE = ""
"""The name that stands for the session that runs."""


class Viewers:
    """One viewer at a time; its processes end with this one."""

    def __init__(self, *, rig_file: Path) -> None:
        self._rig_file = rig_file
        self._lock = threading.Lock()
        self._asked = 0
        self._ends: list[Callable[[], None]] = []
        self.state: dict[str, Any] | None = None
        """The state for the page: `of` (a recording's name, or nothing for the session), `url` or `fault`."""

    def show(self, name: str, recording: Path | None) -> None:
        """Shows a recording, or the session that runs, instead of whatever was shown; drawing takes a while.

        Raises:
            UserError: if the viewer is not installed.
        """
        viewer.binary()
        with self._lock:
            self._close()
            self.state = {"of": name, "url": "", "fault": ""}
            threading.Thread(target=self._open, args=(self._asked, name, recording), name="viewer", daemon=True).start()

    def _open(self, asked: int, name: str, recording: Path | None) -> None:
        url, fault = "", ""
        mine: list[Callable[[], None]] = []
        try:
            url = self._live(mine) if recording is None else _recorded(recording, mine)
        except UserError as error:
            fault = str(error)
        with self._lock:
            if fault or asked != self._asked:  # nothing can be shown, or something else is by now
                _end(mine)
            if asked != self._asked:
                return
            self._ends = mine
            self.state = {"of": name, "url": url, "fault": fault}

    def _live(self, mine: list[Callable[[], None]]) -> str:
        port = viewer.free_port()
        words = ["replay", "--live", "--rig", str(self._rig_file), "--no-viewer", "--port", str(port)]
        streaming = start([sys.executable, "-m", "station", *words], quiet=True)
        mine.append(partial(_ended, streaming))
        served = serve_stream(streaming, port)
        mine.append(served.end)
        return served.url

    def end(self) -> None:
        """Ends the viewer."""
        with self._lock:
            self._close()

    def _close(self) -> None:
        self._asked += 1
        _end(self._ends)
        self._ends, self.state = [], None


def _recorded(recording: Path, mine: list[Callable[[], None]]) -> str:
    """Draws the recording where no newer drawing lies beside it, and serves that."""
    drawn = recording.with_suffix(".rrd")
    if not drawn.exists() or drawn.stat().st_mtime < recording.stat().st_mtime:
        words = ["replay", str(recording), "--save", str(drawn), "--no-viewer"]
        drawing = start([sys.executable, "-m", "station", *words], piped=True)
        said = drawing.communicate()[0].decode(errors="replace").strip()
        if drawing.returncode:
            raise UserError(
                said.splitlines()[-1]
                if said
                else "The recording could not be drawn: the program that draws it was ended; try again"
            )
    served = serve_file(drawn)
    mine.append(served.end)
    return served.url


def _end(ends: Sequence[Callable[[], None]]) -> None:
    for end in ends:
        end()


def _ended(process: subprocess.Popen[bytes]) -> None:
    if process.poll() is None:
        ask_to_end(process)
