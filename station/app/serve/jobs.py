"""Work on recordings that a page asks for: each is a command of `station` in a process of its own, one at a time."""

from __future__ import annotations

import subprocess
import sys
import threading
from collections import deque
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

from shared.errors import UserError
from shared.system.processes import ask_to_end, start
from station.app.serve.shelf import DIAGNOSIS, REPORT, Shelf

_LINES = 200
"""Lines of a command's output that are kept; the rest is in what it writes."""
_GRACE_S = 40.0
"""A session that is asked to end brings the plate back to level first, in up to 20 s."""
KINDS = ("doctor", REPORT, DIAGNOSIS)
_FINDINGS = 1
"""The exit status of a command that came to its end and has something to say."""


def words_of(kind: str, recording: Path, shelf: Shelf) -> list[str]:
    """Returns the command of `station` that does it.

    Raises:
        UserError: for an unknown kind.
    """
    page = shelf.page(recording, kind)
    commands = {
        "doctor": ["doctor", str(recording)],
        REPORT: ["analyze", str(recording), "--out", str(page.parent)],
        DIAGNOSIS: ["diagnose", str(recording), "--report", str(page)],
    }
    if kind not in commands:
        raise UserError(f"Expected one of {', '.join(KINDS)}, got '{kind}'")
    return commands[kind]


@dataclass(eq=False)
class Program:
    """A command of `station` that runs, or has run: its last lines, and its exit status when it has ended."""

    words: list[str]
    recording: str = ""
    kind: str = ""
    lines: deque[str] = field(default_factory=lambda: deque[str](maxlen=_LINES))
    process: subprocess.Popen[bytes] | None = None

    def begin(self) -> None:
        """Starts it. It ends in order when this process does, however that ends."""
        self.lines.append(f"$ station {' '.join(self.words)}")
        self.process = start([sys.executable, "-m", "station", *self.words], piped=True)
        if self.process.stdout is not None:
            threading.Thread(target=self._read, args=(self.process.stdout,), name="output", daemon=True).start()

    def _read(self, out: IO[bytes]) -> None:
        with out:
            for line in out:
                self.lines.append(line.decode(errors="replace").rstrip())

    @property
    def runs(self) -> bool:
        """True until it has ended."""
        return self.process is not None and self.process.poll() is None

    def end(self, *, grace_s: float = _GRACE_S) -> None:
        """Asks it to end in order, and ends it when it does not."""
        if self.process is None or not self.runs:
            return
        ask_to_end(self.process)
        try:
            self.process.wait(grace_s)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()

    def state(self) -> dict[str, Any]:
        """Returns its state for the page; `status` is None while it runs."""
        status = None if self.process is None else self.process.poll()
        done = status in (0, _FINDINGS)
        return {
            "recording": self.recording,
            "kind": self.kind,
            "running": self.runs,
            "status": status,
            "lines": list(self.lines),
            "page": done and self.kind in (REPORT, DIAGNOSIS),
        }


class Jobs:
    """The newest command on a recording. A second one is refused while the first runs."""

    def __init__(self, shelf: Shelf) -> None:
        self._shelf = shelf
        self._lock = threading.Lock()
        self.newest: Program | None = None

    def begin(self, kind: str, name: str) -> None:
        """Starts one.

        Raises:
            UserError: for an unknown kind or recording, or while another one runs.
        """
        recording = self._shelf.path(name)
        words = words_of(kind, recording, self._shelf)
        with self._lock:
            if self.newest is not None and self.newest.runs:
                raise UserError(f"Expected one command at a time; `station {self.newest.words[0]}` still runs")
            self.newest = Program(words, recording=name, kind=kind)
            self.newest.begin()

    def state(self) -> dict[str, Any] | None:
        """Returns the newest one, for the page."""
        return None if self.newest is None else self.newest.state()

    def end(self) -> None:
        """Ends the one that runs."""
        if self.newest is not None:
            self.newest.end(grace_s=2.0)
