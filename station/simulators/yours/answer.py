"""Checks what a user's function gave back: a path that begins where the block lies, or an onset."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator

from station.physics.contact import Array
from station.simulators.yours.run import Run

LONGEST_STEP_S = 0.05
"""A path is interpolated: with longer steps a slide of 0.2 s would have fewer than four places. `station diagnose
--simulate` says so of a function that gives them, as tests/unit/simulators/test_yours.py shows."""
BESIDE_M, TURNED_RAD = 2e-3, 0.1
"""A path that begins farther than this from where the block lies is in another unit or frame: marks are read to some
0.05 mm, and 2 mm are a fifth of the block."""
MISSING_S = 0.1
"""A path may end so much before its run: the last frame, and a step of the function's own."""
WAYS_M, NEAR = (8e-6, 64e-6, 512e-6), 0.9
"""An onset is read from when a path reaches these ways, a tenth of a pixel to five pixels. With 1 ms steps it is right
to a few ms (tests/unit/simulators/test_yours.py). A block creeps with the load, so at 0.9 of it most creep is over."""


class Answer(NamedTuple):
    """The path: times (k,), poses (k, 3) and the onset, s (nan: none). `known` is False if only the onset is."""

    t_s: Array
    pose: Array
    onset_s: float
    known: bool

    @property
    def is_nothing(self) -> bool:
        """True if neither a path nor an onset was given: the block held."""
        return self.known and len(self.t_s) == 1

    def at(self, time_s: Array) -> Array:
        """Returns the poses (m, 3) at `time_s` (m,), s, by cubics that never overshoot.

        Before the path begins and after it ends the block lies where it was. They are nan after the onset where nothing
        is known.
        """
        if self.is_nothing:
            return np.repeat(self.pose, len(time_s), axis=0)
        if self.known:
            return PchipInterpolator(self.t_s, self.pose)(np.clip(time_s, self.t_s[0], self.t_s[-1]))
        lying = ~(time_s > self.onset_s)
        return np.where(lying[:, None], self.pose[0], np.nan)


def answer_of(given: Any, run: Run) -> Answer:
    """Returns the answer of a function for a run, as a checked path.

    Raises:
        ValueError: with what was expected and what came.
    """
    start = np.array([run.x_m, run.y_m, run.yaw_rad])
    if given is None or (isinstance(given, int | float | np.integer | np.floating) and not isinstance(given, bool)):
        onset = math.nan if given is None else float(given)
        if math.isinf(onset) or not (math.isnan(onset) or 0.0 <= onset <= run.end_s):
            raise ValueError(f"expected an onset between 0 and {run.end_s:.2f} s (nan: none), got {onset:g}")
        return Answer(np.zeros(1), start[None], onset, known=math.isnan(onset))
    table, onset = _table(given)
    _refuse(table, run)
    found = Answer(table[:, 0], table[:, 1:], math.nan, known=True) if len(table) > 1 else None
    if found is None:
        raise ValueError("expected at least two moments in the path, got one")
    return found._replace(onset_s=onset_of(found, run) if onset is None else onset)


def _table(given: Any) -> tuple[Array, float | None]:
    """Returns rows of t, x, y, yaw (k, 4), and the onset if it is stated."""
    columns = given
    onset = None
    if all(hasattr(given, name) for name in ("t_s", "x_m", "y_m", "yaw_rad")):
        parts = [np.asarray(getattr(given, name)).ravel() for name in ("t_s", "x_m", "y_m", "yaw_rad")]
        if len({len(part) for part in parts}) > 1:
            lengths = ", ".join(str(len(part)) for part in parts)
            raise ValueError(f"expected t_s, x_m, y_m and yaw_rad of one length, got {lengths}")
        columns = np.column_stack(parts)
        onset = getattr(given, "onset_s", None)
    try:
        if isinstance(columns, bool) or np.iscomplexobj(np.asarray(columns)):
            raise TypeError(columns)
        table = np.asarray(columns, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(
            f"expected rows of t, x, y, yaw, a Path or an onset in seconds, got {type(given).__name__}"
        ) from None
    if table.ndim != 2 or table.shape[1] != 4:
        raise ValueError(f"expected an array of shape (k, 4) with rows of t, x, y, yaw, got shape {table.shape}")
    return table, None if onset is None else float(onset)


def _refuse(table: Array, run: Run) -> None:
    """Raises a ValueError for a path that is not one of this block in this run."""
    if not np.isfinite(table).all():
        bad = int(np.flatnonzero(~np.isfinite(table).all(axis=1))[0])
        raise ValueError(f"expected finite numbers, got {_row(table[bad])} in row {bad} of the path")
    steps = np.diff(table[:, 0])
    if (steps <= 0).any():
        raise ValueError("expected times that increase from row to row of the path")
    if len(steps) and steps.max() > LONGEST_STEP_S:
        raise ValueError(
            f"expected moments at most {LONGEST_STEP_S:g} s apart, got {steps.max():.3g} s: store more of the path"
        )
    if table[-1, 0] < run.end_s - MISSING_S:
        raise ValueError(f"expected the path up to the run's end at {run.end_s:.2f} s, got {table[-1, 0]:.2f} s")
    away = math.hypot(table[0, 1] - run.x_m, table[0, 2] - run.y_m)
    turned = abs(math.remainder(table[0, 3] - run.yaw_rad, 2 * math.pi))
    if away > BESIDE_M or turned > TURNED_RAD:
        raise ValueError(
            f"expected the path to begin where the block lies, at {_row(np.array([run.x_m, run.y_m, run.yaw_rad]))} "
            f"(m, m, rad, plate frame), got {_row(table[0, 1:])}: look at the units and the frame"
        )


def _row(values: Array) -> str:
    return ", ".join(f"{value:.4g}" for value in values)


def onset_of(found: Answer, run: Run) -> float:
    """Returns the moment at which the slide began, s; nan without one.

    The times t1, t2, t3 at which the block is 8, 64 and 512 µm away follow d = c (t − t0)^p on whatever law it slides
    by: t0 = t1 − (t2 − t1)² / ((t3 − t2) − (t2 − t1)). Ways are from where the block was at nine tenths of the load,
    since an engine's soft contact lets it creep before; that is judged apart (`artefacts`).
    """
    slid = np.flatnonzero(_away(found, 0) > WAYS_M[-1])
    if not len(slid):
        return math.nan
    gravity = np.column_stack([np.interp(found.t_s, run.t_s, axis) for axis in run.gravity_m_s2.T])
    steep = np.hypot(gravity[:, 0], gravity[:, 1]) / np.maximum(-gravity[:, 2], 1e-9)
    lying = np.flatnonzero(steep[: slid[0]] < NEAR * steep[slid[0]])
    base = int(lying[-1]) if len(lying) else 0
    away = np.maximum.accumulate(_away(found, base)[base:])
    first, second, third = (_reached(found.t_s[base:], away, way) for way in WAYS_M)
    bend = (third - second) - (second - first)
    begun = first - (second - first) ** 2 / bend if bend > 0 else first
    return float(np.clip(begun, found.t_s[base], first))


def _away(found: Answer, base: int) -> Array:
    return np.hypot(*(found.pose[:, :2] - found.pose[base, :2]).T)


def _reached(time_s: Array, away: Array, way_m: float) -> float:
    """Returns the moment at which a way that never shrinks first reaches `way_m`; its last moment if it does not."""
    at = int(np.argmax(away >= way_m)) if away[-1] >= way_m else len(away) - 1
    return float(np.interp(way_m, away[at - 1 : at + 1], time_s[at - 1 : at + 1])) if at else float(time_s[0])
