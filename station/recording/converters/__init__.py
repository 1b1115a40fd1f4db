"""Converters make of a recording what other tools read. Each is one file here, found by being here.

A converter has

    NAME = "rosbag2"                          # as in `station convert --to rosbag2`
    HELP = "one line"
    def convert(reader: RecordingReader, out: Path) -> Converted: ...   # raises UserError; `out` does not exist yet

A file whose name begins with an underscore is a part of another.
"""

from __future__ import annotations

import importlib
import pkgutil
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol, cast

from station.recording.reader import RecordingReader


@dataclass(frozen=True, kw_only=True)
class Converted:
    """The result of a conversion: the type and the number of messages of each topic written, and what is left out."""

    written: dict[str, tuple[str, int]]
    left_out: dict[str, int] = field(default_factory=dict[str, int])


class Converter(Protocol):
    """One file of this folder."""

    NAME: str
    HELP: str

    def convert(self, reader: RecordingReader, out: Path) -> Converted:
        """Writes the recording in this format to `out`."""
        ...


def converters() -> dict[str, Converter]:
    """Returns every converter by its name."""
    names = [found.name for found in pkgutil.iter_modules(__path__) if not found.name.startswith("_")]
    found = [cast(Converter, importlib.import_module(f"{__name__}.{name}")) for name in names]
    return {converter.NAME: converter for converter in found}
