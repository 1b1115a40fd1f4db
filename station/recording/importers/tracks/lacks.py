"""The columns that a table of tracks could have and has not, and what is taken for granted in their place."""

from __future__ import annotations

from station.recording.importers.tracks.table import Tracks
from station.recording.importers.tracks.units import names_of

GRANTED = {
    "mass": "every block has 8 g",
    "area": "every block has a sole of 10 mm by 10 mm",
    "temperature": "it is unknown",
    "relative_humidity": "it is unknown",
    "dwell": "each block has lain since its run's first row",
    "plate_mount": "the plate is never turned in its mount",
    "z": "the block never leaves the plate",
    "sigma": "the track's noise is what its frames show",
    "group": "all runs have the same block",
}


def lacking(table: Tracks, *, one_clock: bool, fixed: int, runs: int) -> tuple[str, ...]:
    """Returns one line for each column that is not there; `fixed` of the runs have a plate that does not turn."""
    missing = [f"No {names_of(name)[0]}: {granted}." for name, granted in GRANTED.items() if not _has(table, name)]
    if fixed:
        missing.append(
            f"The plate does not turn in {fixed} of {runs} runs: these have no onset, so that they tell of the sliding "
            "friction alone, from where the block has visibly moved."
        )
    if not one_clock:
        missing.append("Each run has its own clock: the time between runs is unknown, and only their order counts.")
    return tuple(missing)


def _has(table: Tracks, quantity: str) -> bool:
    return quantity in table or (quantity == "group" and bool(table.group))
