"""Prints what the terminal shows when a session is over."""

from __future__ import annotations

from pathlib import Path

from shared.notes import note_line
from shared.programs import how_to_call
from station.app.attached import planted_in_recording
from station.app.commands import samples
from station.app.sentences import print_sentence
from station.recording.reader import open_recording
from station.recording.tables import read_samples


def print_summary(path: Path) -> None:
    """Prints the table of samples, what the rig conceals on purpose, where the recording lies, and what looks at it."""
    samples.show(read_samples(path), samples.console(), source=path)
    for note in planted_in_recording(open_recording(path)):
        print_sentence(note_line(note))
    station = how_to_call("station")
    print(f"Recording: {path}")
    print(f"Replay it:  {station} replay {path}    (plain `{how_to_call('rerun')} {path}` works, too)")
    print(f"Check it:   {station} doctor {path}", flush=True)
