"""Chooses a session's display: a panel on a terminal, plain lines elsewhere, JSON lines where they are asked for."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Protocol, Self

from rich.console import Console

from shared.bus import Bus
from station.app.display.json_lines import JsonLinesDisplay
from station.app.display.panel import PanelDisplay
from station.app.display.plain import PlainDisplay
from station.app.display.watched import Watched
from station.sampling.plan import Plan


class Display(Protocol):
    """Shows a session while it runs; a context manager."""

    def __enter__(self) -> Self:
        """Begins to show the session."""
        ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None, /
    ) -> None:
        """Ends the display, in whatever way the session ended."""
        ...

    def attach(self, bus: Bus) -> None:
        """Follows the session on this bus."""
        ...

    def line(self, level: str, text: str) -> None:
        """Takes a line of the session's log."""
        ...

    def tell(self, done: int) -> None:
        """Shows that `done` samples are there; called often."""
        ...

    def end(self, fault: str) -> None:
        """Shows that the recording is closed; `fault` is empty or says why the session ended early."""
        ...


def display_of(
    console: Console,
    plan: Plan,
    path: Path,
    *,
    json_lines: bool,
    nominal_hz: float = 0.0,
    notes: Sequence[str] = (),
) -> Display:
    """Returns the display of a session that is recorded to `path`; `nominal_hz` is the rate of the rig's camera.

    `notes` on the rig are told to scripts at the start; on the terminal they stand in the summary at the end.
    """
    watched = Watched(plan, path, nominal_hz=nominal_hz)
    if json_lines:
        return JsonLinesDisplay(sys.stdout, watched, path=path, total=plan.samples, notes=notes)
    if console.is_terminal:
        return PanelDisplay(console, watched)
    return PlainDisplay(console, total=plan.samples)
