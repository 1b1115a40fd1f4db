"""Prints what the terminal shows when a session is over."""

from __future__ import annotations

from pathlib import Path

from shared.programs import how_to_call
from station.app.commands import samples
from station.recording.tables import read_samples


def print_summary(path: Path) -> None:
    """The table of samples, where the recording lies, and the commands that look at it."""
    samples.show(read_samples(path), samples.console(), source=path)
    station = how_to_call("station")
    print(f"Recording: {path}")
    print(f"Replay it:  {station} replay {path}    (plain `{how_to_call('rerun')} {path}` works, too)")
    print(f"Check it:   {station} doctor {path}", flush=True)
