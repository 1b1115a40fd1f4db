"""Importers turn other people's measurements into recordings. Each is one file here, found by being here.

An importer has

    NAME = "cube-tosses"                      # as in `station import cube-tosses`
    HELP = "one line"
    def read(source: Path, *, onset: Traced | None = None) -> Imported: ...   # raises UserError for a wrong source
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, cast

from shared.messages import Message
from station.recording.provenance import Provenance
from station.recording.writer import Recording

Item = tuple[str, int, Message]
"""Topic, receive time (ns) and message."""

Traced = Callable[..., Any]
"""`station.friction.onset.estimate_onset`, which the command hands over: what records may not import what measures."""


@dataclass(frozen=True, kw_only=True)
class Imported:
    """What an importer read: where it comes from, and the messages in order of their receive time.

    `lacking` has one line for each thing that the source could say and does not.
    """

    provenance: Provenance
    messages: Iterable[Item]
    lacking: tuple[str, ...] = ()


class Importer(Protocol):
    """One file of this folder."""

    NAME: str
    HELP: str

    def read(self, source: Path, *, onset: Traced | None = None) -> Imported:
        """Reads a foreign file; where it has slides and no onsets, `onset` estimates these."""
        ...


def importers() -> dict[str, Importer]:
    """Every importer by its name."""
    modules = (importlib.import_module(f"{__name__}.{found.name}") for found in pkgutil.iter_modules(__path__))
    found = [cast(Importer, module) for module in modules]
    return {importer.NAME: importer for importer in found}


def write(imported: Imported, path: Path, *, overwrite: bool = False) -> int:
    """Writes what was imported as a recording; gives the number of messages.

    Raises:
        UserError: if the recording exists or cannot be written, or the source turns out to be wrong on the way.
    """
    count = 0
    with Recording(path, provenance=imported.provenance, overwrite=overwrite) as recording:
        for topic, receive_ns, message in imported.messages:
            recording.write_message(topic, message, receive_ns=receive_ns)
            count += 1
    return count
