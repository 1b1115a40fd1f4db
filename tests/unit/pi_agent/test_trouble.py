"""The lines on a marker that is not tracked: few, however often the reason changes."""

from __future__ import annotations

from pi_agent.journal import Journal
from pi_agent.trouble import Trouble
from shared.clock import SimulatedClock
from shared.foxglove import Log

SIZE = "The marker is in the picture but not trusted: wrong size: {} px where 34 to 63 are expected"
NONE = "No marker in the picture"
FRAME_NS = 11_000_000


def lines_of(faults: list[str]) -> list[str]:
    """The lines that are written over frames with these faults."""
    lines = list[str]()

    def keep(_: str, line: Log) -> None:
        lines.append(line.message)

    trouble = Trouble(Journal(keep, SimulatedClock()))
    for number, fault in enumerate(faults):
        trouble.see(fault, capture_ns=number * FRAME_NS, assumed=False)
    return lines


def test_reasons_in_turn_are_told_once_each_and_the_end_too() -> None:
    turns = [SIZE.format(20 + number % 5) if number % 2 else NONE for number in range(300)]
    assert lines_of([*turns, *[""] * 60]) == [NONE, SIZE.format(21), "The marker is found again"]


def test_a_marker_that_is_seen_for_a_moment_ends_no_trouble() -> None:
    assert lines_of([*[NONE] * 50, *[""] * 9, *[NONE] * 50]) == [NONE]


def test_the_next_trouble_is_told_again() -> None:
    assert lines_of([NONE, *[""] * 60, NONE]) == [NONE, "The marker is found again", NONE]
