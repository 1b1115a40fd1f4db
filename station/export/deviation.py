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
from typing import Any

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
_STEEPEST_RAD = math.radians(80)
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
file = importlib.import_module(asked["module"])
paths = [file.tilt_test(file.example(), file.Ramp(*ramp)).tolist() for ramp in asked["ramps"]]
with open("paths.json", "w") as out:  # an engine may print what it likes
    json.dump(paths, out)
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Deviation:
    """By how much the engine's onset is late (degrees), its path (mm) and its turn (degrees) are off, in a direction.

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


def deviations(file: ExportedFile, model: Model, directions: Sequence[float]) -> list[Deviation]:
    """The deviations (n,) in directions (n,), rad, of the descent in the plate.

    Raises:
        UserError: if the block does not slide by itself, or the file does not run, such as without its engine.
    """
    steepest = [_from_level(model, down) for down in directions]
    if not np.isfinite(steepest).all():
        raise UserError("Expected a block that slides by 80 degrees of tilt in every direction, to compare with")
    chosen = [
        Ramp(down, max(at - BELOW_RAD, 0.0), RATE_RAD_S, min(at, BELOW_RAD) / RATE_RAD_S + AFTER_S)
        for down, at in zip(directions, steepest, strict=True)
    ]
    return [
        _deviation(ramp, path, _ours(model, ramp, path)) for ramp, path in zip(chosen, _run(file, chosen), strict=True)
    ]


def _from_level(model: Model, down_rad: float) -> float:
    ends = [0.0, _STEEPEST_RAD / RATE_RAD_S]
    return float(simulate(ramps(ends, [0.0, _STEEPEST_RAD], downhill_rad=down_rad), model).onset_rad[0])


def _ours(model: Model, ramp: Ramp, path: Array) -> Array:
    """Our own path at the same times."""
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
    """The tilt at the onset, and how far x, y and yaw (3,) have come `followed_s` after it."""
    row, step_s = onset(path), path[1, 0] - path[0, 0]
    rows = np.arange(len(path))

    def at(number: float, column: int) -> float:
        return float(np.interp(number, rows, path[:, column], right=math.nan))

    end = row + followed_s / step_s
    return at(row, 1), np.array([at(end, column) - path[0, column] for column in (2, 3, 4)])


def _run(file: ExportedFile, chosen: Sequence[Ramp]) -> list[Array]:
    with TemporaryDirectory() as folder:
        Path(folder, file.name).write_text(file.text, encoding="utf-8")
        asked = {"path": [folder, *sys.path], "module": Path(file.name).stem, "ramps": [list(ramp) for ramp in chosen]}
        words = [sys.executable, "-I", "-c", _CHILD]
        told: dict[str, Any] = {"input": json.dumps(asked), "encoding": "utf-8", "timeout": _LONGEST_S}
        done = subprocess.run(words, cwd=folder, capture_output=True, check=False, **told)
        if done.returncode:
            last = (done.stderr.strip().splitlines() or ["nothing was said"])[-1]
            raise UserError(f"Expected {file.name} to run in its engine, but it ended with: {last}")
        return [np.array(path) for path in json.loads(Path(folder, "paths.json").read_text(encoding="utf-8"))]
