"""Measures how far an exported file's block, in its engine, is from our own simulation of the same model.

The file is imported by a Python of its own, in which this package cannot be imported. Both tilt the plate at 2°/s from
2° below the onset until 0.6 s after it; the onset is where the block has gone 0.1 mm, and paths are compared a quarter
of a second after each one's own onset: an onset that is late by itself would else count twice.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np

from shared.errors import UserError
from station.export.carried.tilt_test import Ramp, onset
from station.export.exported import ExportedFile
from station.physics.contact import Array
from station.physics.model import Model
from station.simulators.planar.commands import Commands, ramps
from station.simulators.planar.simulate import simulate

RATE_RAD_S = math.radians(2)
BELOW_RAD = math.radians(2)
AFTER_S, FOLLOWED_S = 0.6, 0.25
_STEEPEST_RAD, _FARTHER_RAD = math.radians(80), math.radians(2)
_LONGEST_S = 500
_SHORT_S = 0.01

_CHILD = """
import importlib, json, sys

class Nothing:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ("station", "shared", "pi_agent"):
            raise ImportError(f"an exported file may not need {name}")

asked = json.load(sys.stdin)
sys.path[:] = asked["path"]
sys.meta_path.insert(0, Nothing())
paths = []
for module, ramps in asked["files"]:
    file = importlib.import_module(module)
    paths.append([file.tilt_test(file.example(), file.Ramp(*ramp)).tolist() for ramp in ramps])
with open("paths.json", "w") as out:  # an engine may print what it likes
    json.dump(paths, out)
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Deviation:
    """The engine's errors in a direction: its onset is late (degrees), its path (mm) and turn (degrees) are off.

    `gone_mm` and `turned_deg` are how far our own block has gone and turned, `speed_mm_s` is how fast it is then.
    """

    down_deg: float
    onset_deg: float
    path_mm: float
    turn_deg: float
    gone_mm: float
    turned_deg: float
    speed_mm_s: float

    @property
    def path_ms(self) -> float:
        """The time, ms, in which our own block goes as far as the paths are apart."""
        return 1e3 * self.path_mm / self.speed_mm_s


class Compared(NamedTuple):
    """An exported file, the model that it is of, and directions (n,), rad, of the descent in the plate."""

    file: ExportedFile
    model: Model
    directions: Sequence[float]


def deviations(file: ExportedFile, model: Model, directions: Sequence[float]) -> list[Deviation]:
    """Returns the deviations (n,) in directions (n,), rad, of the descent in the plate.

    Raises:
        UserError: if the block does not slide by itself, or the file does not run, such as without its engine.
    """
    (found,) = all_deviations([Compared(file, model, directions)])
    return found


def all_deviations(compared: Sequence[Compared]) -> list[list[Deviation]]:
    """Returns the deviations of files of one engine, which one Python runs one after another.

    An engine loads for a second.

    Raises:
        UserError: as `deviations`, for any of the files; also if two have one name.
    """
    if len({one.file.name for one in compared}) < len(compared):
        raise UserError("Expected files of different names to run together, but two have the same; rename one")
    chosen = [_ramps(one.model, one.directions) for one in compared]
    ran = _run([one.file for one in compared], chosen)
    return [
        [_deviation(ramp, path, _ours(one.model, ramp, path)) for ramp, path in zip(of_file, paths, strict=True)]
        for one, of_file, paths in zip(compared, chosen, ran, strict=True)
    ]


def _ramps(model: Model, directions: Sequence[float]) -> list[Ramp]:
    steepest = _from_level(model, directions)
    if not np.isfinite(steepest).all():
        raise UserError("Expected a block that slides by 80 degrees of tilt in every direction, to compare with")
    return [
        Ramp(down, max(at - BELOW_RAD, 0.0), RATE_RAD_S, min(at, BELOW_RAD) / RATE_RAD_S + AFTER_S)
        for down, at in zip(directions, steepest.tolist(), strict=True)
    ]


def _from_level(model: Model, directions: Sequence[float]) -> Array:
    """Returns the tilts (n,) at which the blocks start from level; nan for one that holds to the steepest tilt.

    The ramps end soon after: a slide up to the steepest tilt would take most of the comparison's time.
    """
    found = np.full(len(directions), np.nan)
    for end in np.arange(_FARTHER_RAD, _STEEPEST_RAD + 0.5 * _FARTHER_RAD, _FARTHER_RAD):
        (left,) = np.nonzero(np.isnan(found))
        if not len(left):
            break
        slopes = np.asarray(directions)[left]
        found[left] = simulate(ramps([0.0, end / RATE_RAD_S], [0.0, end], downhill_rad=slopes), model).onset_rad
    return found


def _ours(model: Model, ramp: Ramp, path: Array) -> Array:
    """Returns our own path at the same times."""
    moved = simulate(_commands(ramp), model, time_s=path[:, 0])
    return np.column_stack([path[:, :2], moved.path[0]])


def _commands(ramp: Ramp) -> Commands:
    times = [0.0, ramp.held_s, ramp.held_s + ramp.seconds]
    return ramps(times, [ramp.tilt_rad(time) for time in times], downhill_rad=ramp.down_rad)


def _deviation(ramp: Ramp, path: Array, ours: Array) -> Deviation:
    theirs, own = _seen(path), _seen(ours)
    apart = theirs[1] - own[1]
    return Deviation(
        down_deg=math.degrees(ramp.down_rad),
        onset_deg=math.degrees(theirs[0] - own[0]),
        path_mm=1e3 * math.hypot(apart[0], apart[1]),
        turn_deg=math.degrees(apart[2]),
        gone_mm=1e3 * math.hypot(*own[1][:2]),
        turned_deg=math.degrees(own[1][2]),
        speed_mm_s=1e3 * math.hypot(*(own[1] - _seen(ours, followed_s=FOLLOWED_S - _SHORT_S)[1])[:2]) / _SHORT_S,
    )


def _seen(path: Array, *, followed_s: float = FOLLOWED_S) -> tuple[float, Array]:
    """Returns the tilt at the onset, and how far x, y and yaw (3,) have come `followed_s` after it."""
    row, step_s = onset(path), path[1, 0] - path[0, 0]
    rows = np.arange(len(path))

    def at(number: float, column: int) -> float:
        return float(np.interp(number, rows, path[:, column], right=math.nan))

    end = row + followed_s / step_s
    return at(row, 1), np.array([at(end, column) - path[0, column] for column in (2, 3, 4)])


def _run(files: Sequence[ExportedFile], chosen: Sequence[Sequence[Ramp]]) -> list[list[Array]]:
    with TemporaryDirectory() as folder:
        for file in files:
            Path(folder, file.name).write_text(file.text, encoding="utf-8")
        ramps = [[list(ramp) for ramp in of_file] for of_file in chosen]
        modules = [Path(file.name).stem for file in files]
        asked = {"path": [folder, *sys.path], "files": list(zip(modules, ramps, strict=True))}
        words = [sys.executable, "-I", "-c", _CHILD]
        options: dict[str, Any] = {"input": json.dumps(asked), "encoding": "utf-8", "timeout": _LONGEST_S}
        done = subprocess.run(words, cwd=folder, capture_output=True, check=False, **options)
        if done.returncode:
            last = (done.stderr.strip().splitlines() or ["nothing was said"])[-1]
            names = ", ".join(file.name for file in files)
            raise UserError(f"Expected {names} to run in its engine, but it ended with: {last}")
        paths = json.loads(Path(folder, "paths.json").read_text(encoding="utf-8"))
        return [[np.array(path) for path in of_file] for of_file in paths]
