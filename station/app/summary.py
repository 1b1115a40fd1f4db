"""What the terminal shows when a session is over."""

from __future__ import annotations

from pathlib import Path


def print_summary(path: Path) -> None:
    """The table of samples, where the recording lies, and the command that replays it."""
    print(f"Recording: {path}")
    print(f"Look at it: station replay {path}")
