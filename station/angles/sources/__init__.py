"""Angle sources: one file each, found by its name in this folder and imported only when it is asked for.

A source file defines `connect(link: SourceLink) -> AngleSource` and `ON_DEMAND`, which says that the source speaks
only when it is asked (a person who reads a gauge), so that its silence means nothing.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol, cast

from shared.bus import Bus
from shared.clock import Clock
from shared.config import Table
from shared.errors import UserError
from station.angles.reading import Reading


def _say_nothing(_: str) -> None:
    return


@dataclass(frozen=True, kw_only=True)
class SourceLink:
    """The things that a source may use: its name, the bus, the station's clock, its own options.

    `complain` takes one sentence about something unreadable that was left out; it may be called from any thread.
    """

    name: str
    bus: Bus
    clock: Clock
    options: Table = field(default_factory=lambda: Table({}))
    complain: Callable[[str], None] = _say_nothing


class AngleSource(Protocol):
    """One angle sensor. Faults are raised as OSError or UserError; the source is then closed and opened again."""

    def open(self) -> None:
        """Connects to the sensor; may take seconds."""
        ...

    def read(self) -> tuple[Reading, ...]:
        """Returns all readings since the last call, in order, stamped by the station's clock; never waits for one."""
        ...

    def close(self) -> None:
        """Lets go of the sensor; allowed at any time, also when it is not open."""
        ...


class SourceModule(Protocol):
    """The contents of a file in this folder."""

    ON_DEMAND: bool

    def connect(self, link: SourceLink) -> AngleSource:
        """Returns the source for a table of rig.toml, not yet open; raises UserError when an option is wrong."""
        ...


def source_kinds() -> tuple[str, ...]:
    """Returns the names of all files in this folder."""
    return tuple(sorted(path.stem for path in Path(__file__).parent.glob("*.py") if not path.stem.startswith("_")))


def load_kind(kind: str) -> SourceModule:
    """Imports one kind of source.

    Raises:
        UserError: if there is none of this name, or a package that it needs is not installed.
    """
    if kind not in source_kinds():
        raise UserError(f"Expected an angle source in rig.toml, one of {', '.join(source_kinds())}; got {kind!r}")
    return cast(SourceModule, importlib.import_module(f"{__name__}.{kind}"))
