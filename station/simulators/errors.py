"""The errors of a simulation of a recording, run by run, and the figures that sum them up."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from shared.messages import Sample
from station.physics.contact import Array
from station.signals.session import Signals
from station.signals.tracks import Times
from station.simulators import figures
from station.simulators.recorded_runs import Poses, poses_of, recorded_runs


@dataclass(frozen=True, eq=False, kw_only=True)
class Errors:
    """Differences of a simulation from the recording, run by run (n,); nan where there is nothing to compare.

    `onset_deg` is simulated minus recorded; `path_mm` and `turn_deg` are the root mean square distance and difference
    of the yaws over the frames from the recorded onset to the run's end.
    """

    run: Array
    onset_deg: Array
    path_mm: Array
    turn_deg: Array

    def summary(self) -> dict[str, Any]:
        """Returns plain and robust figures over the runs that have them, and `se` with the standard error of each."""
        onset, path, turn = self.onset_deg, self.path_mm, self.turn_deg
        found = {
            "onset_rmse_deg": figures.rms(onset),
            "path_rmse_mm": figures.rms(path),
            "onset_bias_deg": figures.mean(onset),
            "onset_median_deg": figures.median(np.abs(onset)),
            "path_median_mm": figures.median(path),
            "turn_rmse_deg": figures.rms(turn),
            "turn_median_deg": figures.median(turn),
            "onset_trimmed_deg": figures.trimmed_rms(onset),
            "path_trimmed_mm": figures.trimmed_rms(path),
        }
        return {
            **{name: _or_none(figure.value) for name, figure in found.items()},
            "se": {name: _or_none(figure.sd) for name, figure in found.items()},
            "onsets": int(np.isfinite(onset).sum()),
            "paths": int(np.isfinite(path).sum()),
        }

    @classmethod
    def joined(cls, parts: Sequence[Errors]) -> Errors:
        """Returns the errors of several parts of the session, in the order of their runs."""
        order = np.argsort(np.concatenate([part.run for part in parts]), kind="stable")
        return cls(
            **{
                name: np.concatenate([getattr(part, name) for part in parts])[order]
                for name in ("run", "onset_deg", "path_mm", "turn_deg")
            }
        )


def errors(recorded: Signals, simulated: Signals) -> Errors:
    """Returns the errors of a simulation of a recording, whose clock and rates may be others.

    Each run counts from its begin.

    A run that the simulation lacks has none, and a slide that it does not show no path: some tell onsets alone.
    """
    runs = recorded_runs(recorded)
    again = {run.run: run for run in recorded_runs(simulated)}
    recorded_poses, simulated_poses = poses_of(recorded), poses_of(simulated)
    was, now = ({sample.run: sample for sample in each.samples} for each in (recorded, simulated))
    onset, path, turn = np.full((3, len(runs)), np.nan)
    for index, run in enumerate(runs):
        first, second, same = was.get(run.run), now.get(run.run), again.get(run.run)
        begin_ns = run.begin_ns
        if first is not None and second is not None and not run.velocity.any():
            if first.censored:
                continue
            begin_ns = first.slip_ns
            # The sample of a block that held has the steepest tilt: the error is at least as large.
            onset[index] = math.degrees(second.onset_angle_rad - first.onset_angle_rad)
        if same is not None:
            later_ns = same.tilt_ns - run.tilt_ns
            theirs = simulated_poses.between(begin_ns + later_ns - STEP_NS, run.end_ns + later_ns + STEP_NS)
            mine = recorded_poses.between(begin_ns, run.end_ns)
            if not _hidden(mine.time_ns + later_ns, theirs.time_ns, second):
                path[index], turn[index] = _apart(mine, theirs, later_ns=later_ns)
    return Errors(run=np.array([run.run for run in runs]), onset_deg=onset, path_mm=path, turn_deg=turn)


STEP_NS = 200_000_000
"""The longest time between simulated places in which the block is looked for: a camera of 5 Hz shows no slide."""


def _hidden(wanted_ns: Times, known_ns: Times, sample: Sample | None) -> bool:
    """Returns true if a simulated slide is asked for at `wanted_ns` (n,), and is not seen at `known_ns` (k,).

    All times are in the simulation's clock, ns.
    """
    if sample is None or sample.censored or not (wanted_ns > sample.slip_ns).any():
        return False
    return not ((known_ns > sample.slip_ns) & (known_ns <= wanted_ns.max())).any()


def _apart(recorded: Poses, simulated: Poses, *, later_ns: int) -> tuple[float, float]:
    """Returns the root mean square distance (mm) and turn (deg) between two paths at the first's frames in the second.

    Both are nan without such frames.
    """
    times = recorded.time_ns + later_ns
    if len(simulated.time_ns) < 2:
        return math.nan, math.nan
    right = np.clip(np.searchsorted(simulated.time_ns, times), 1, len(simulated.time_ns) - 1)
    inside = (times >= simulated.time_ns[0]) & (times <= simulated.time_ns[-1])
    inside &= simulated.time_ns[right] - simulated.time_ns[right - 1] <= STEP_NS
    if not inside.any():
        return math.nan, math.nan
    base = simulated.time_ns[0]
    known, wanted = (simulated.time_ns - base).astype(float), (times[inside] - base).astype(float)
    pose = simulated.pose.copy()
    pose[:, 2] = np.unwrap(pose[:, 2])
    away = recorded.pose[inside] - np.column_stack([np.interp(wanted, known, axis) for axis in pose.T])
    away[:, 2] = np.angle(np.exp(1j * away[:, 2]))
    square = np.mean(away * away, axis=0)
    return 1e3 * math.hypot(*np.sqrt(square[:2])), math.degrees(math.sqrt(square[2]))


def _or_none(value: float) -> float | None:
    return value if math.isfinite(value) else None
