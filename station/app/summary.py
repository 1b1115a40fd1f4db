"""What the terminal shows when a session is over."""

from __future__ import annotations

import sys
from pathlib import Path

from rich.console import Console

from station.app.commands import samples
from station.recording.tables import read_samples


def print_summary(path: Path) -> None:
    """The table of samples, where the recording lies, and the commands that look at it."""
    console = Console(width=None if sys.stdout.isatty() else 140, highlight=False)
    samples.show(read_samples(path), console, source=path)
    print(f"Recording: {path}")
    print(f"Replay it:  station replay {path}    (plain `rerun {path}` works, too)")
    print(f"Check it:   station doctor {path}", flush=True)
