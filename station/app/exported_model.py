"""Exports a model.toml: as code for an engine, or as a scene where friction by direction is all that it says."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from shared.errors import UserError
from shared.rig import load_rig
from station.app.exporting import print_unsupported, write_files
from station.app.simulating import model_of
from station.export import ExportedFile, export_formats, export_model, model_formats
from station.export.deviation import deviations
from station.export.from_model import NamedModel, named_model

DEFAULT = "numpy"
_DIRECTIONS = np.radians([0.0, 45.0, 150.0, 250.0])
"""Directions along a grain and beside it, and not its mirror images alone."""


def known_formats() -> list[str]:
    """Returns the formats that may be asked for."""
    return sorted({*export_formats(), *model_formats()})


def run(path: Path, formats: Sequence[str], *, out: Path, rig: Path | None, overwrite: bool, compare: bool) -> int:
    """Writes the model in the `formats`, or in all that can say it if they are 'all'; 1 if one of these cannot, or 0.

    Raises:
        UserError: for a model that cannot be read, or that a format which was named cannot say.
    """
    named = named_model(path, model_of(path, rig=load_rig(rig) if rig else None))
    files: dict[str, Sequence[ExportedFile]] = {}
    refused: list[str] = []
    for name in known_formats() if "all" in formats else formats:
        try:
            files[name] = export_model(named, name)
        except UserError as error:
            if "all" not in formats:
                raise
            refused.append(str(error))
    write_files([file for of_format in files.values() for file in of_format], out, overwrite=overwrite)
    print_unsupported(files)
    if compare:
        _compare(named, files)
    for sentence in refused:
        print(f"Not written: {sentence}.")
    return 1 if refused else 0


def _compare(named: NamedModel, files: Mapping[str, Sequence[ExportedFile]]) -> None:
    """Prints how far each file of Python is from our own simulation; an engine that is not installed is named."""
    runnable = [(name, file) for name in files if name in model_formats() for file in files[name]]
    print("\nDeviation from our own simulation (planar), a cube of 10 mm and 7.85 g, 0.25 s after the onset:")
    print(f"{'format':<14} {'down deg':>8} {'onset deg':>10} {'path mm':>8} {'of mm':>7} {'turn deg':>9} {'of deg':>7}")
    for name, file in runnable:
        try:
            found = deviations(file, named.model, _DIRECTIONS.tolist())
        except UserError as error:
            print(f"{name:<14} {error}")
            continue
        for one in found:
            start = f"{name:<14} {one.down_deg:>8.0f} {one.onset_deg:>+10.3f}"
            print(f"{start} {one.path_mm:>8.3f} {one.gone_mm:>7.2f} {one.turn_deg:>+9.3f} {one.turned_deg:>+7.2f}")
        worst = max((abs(one.onset_deg) for one in found), default=math.nan)
        print(f"{name:<14} worst onset {worst:.3f} degrees, worst path {max(one.path_mm for one in found):.3f} mm")
