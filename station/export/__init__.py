"""Measured friction for simulators. A format is one file in `formats`, found by being there.

A format has

    NAME = "mujoco"                 # as in `station export --format mujoco`
    HELP = "one line"
    def export(pairs: Sequence[NamedPair]) -> Sequence[ExportedFile]: ...

or, for a model of `station diagnose`, export_model; or both. Two files may share a name, one for each.

    def export_model(named: NamedModel) -> Sequence[ExportedFile]: ...
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Sequence
from types import ModuleType
from typing import Protocol, cast

from station.export import formats
from station.export.exported import ExportedFile, NamedPair, named
from station.export.from_model import NamedModel, pair_of_model
from station.export.measured import MeasuredPair


class Format(Protocol):
    """One file of the folder `formats`."""

    NAME: str
    HELP: str

    def export(self, pairs: Sequence[NamedPair]) -> Sequence[ExportedFile]:
        """Returns the files that say these pairs' friction in this format."""
        ...


class ModelFormat(Protocol):
    """One file of the folder `formats` that takes a model."""

    NAME: str
    HELP: str

    def export_model(self, named: NamedModel) -> Sequence[ExportedFile]:
        """Returns the files that say this model in this format."""
        ...


def export_formats() -> dict[str, Format]:
    """Returns every format of measured pairs by its name."""
    found = [cast(Format, module) for module in _modules() if hasattr(module, "export")]
    return {each.NAME: each for each in found}


def model_formats() -> dict[str, ModelFormat]:
    """Returns every format of models by its name."""
    found = [cast(ModelFormat, module) for module in _modules() if hasattr(module, "export_model")]
    return {each.NAME: each for each in found}


def export(pairs: Sequence[MeasuredPair], to: Format) -> tuple[ExportedFile, ...]:
    """Returns the files of one format, each with what it cannot say."""
    return tuple(to.export(named(pairs)))


def export_model(named_model: NamedModel, to: str) -> tuple[ExportedFile, ...]:
    """Returns the files of a model in the format `to`; a format of pairs gets it if it is friction by direction alone.

    Raises:
        UserError: if it is more than that.
    """
    if to in (known := model_formats()):
        return tuple(known[to].export_model(named_model))
    return export([pair_of_model(named_model.model, to=to)], export_formats()[to])


def _modules() -> list[ModuleType]:
    return [
        importlib.import_module(f"{formats.__name__}.{found.name}") for found in pkgutil.iter_modules(formats.__path__)
    ]
