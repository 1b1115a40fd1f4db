"""What the terminal shows when a session is over."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

from station.app.commands import samples
from station.recording.tables import read_samples


def print_summary(path: Path) -> None:
    """The table of samples, where the recording lies, and the commands that look at it."""
    samples.show(read_samples(path), samples.console(), source=path)
    command = _command()
    print(f"Recording: {path}")
    print(f"Replay it:  {command} replay {path}    (plain `rerun {path}` works, too)")
    print(f"Check it:   {command} doctor {path}", flush=True)


def _command() -> str:
    """How to call `station` from here: by name if it is on the path, else where this environment has it."""
    return "station" if shutil.which("station") else os.path.relpath(Path(sys.executable).parent / "station")
