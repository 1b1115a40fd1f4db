"""Measured friction for simulators. A format is one file in `formats`, found by being there.

A format has

    NAME = "mujoco"                 # as in `station export --format mujoco`
    HELP = "one line"
    def export(pairs: Sequence[NamedPair]) -> Sequence[ExportedFile]: ...
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Sequence
from typing import Protocol, cast

from station.export import formats
from station.export.exported import ExportedFile, NamedPair, named
from station.export.measured import MeasuredPair


class Format(Protocol):
    """One file of the folder `formats`."""

    NAME: str
    HELP: str

    def export(self, pairs: Sequence[NamedPair]) -> Sequence[ExportedFile]:
        """The files that say these pairs' friction in this format."""
        ...


def export_formats() -> dict[str, Format]:
    """Every format by its name."""
    modules = (
        importlib.import_module(f"{formats.__name__}.{found.name}") for found in pkgutil.iter_modules(formats.__path__)
    )
    found = [cast(Format, module) for module in modules]
    return {each.NAME: each for each in found}


def export(pairs: Sequence[MeasuredPair], to: Format) -> tuple[ExportedFile, ...]:
    """The files of one format, each with what it cannot say."""
    return tuple(to.export(named(pairs)))
