"""The numerical artefacts of a simulation made elsewhere, read from its own recording.

- Creep: in a simulation a block below its onset stays where it is. If it moves down in proportion to the load, v = k g
  sin θ, the contact is soft; k is fitted over all runs, before nine tenths of each run's onset.
- Cone: the ratio of tan(onset) to the friction that was simulated, against the direction of the slope in the plate: a
  pyramid shows as a wave of four periods, whose size is its swing between the directions that were simulated: tilts
  along the axes alone, give or take a degree, tell nothing of what lies between.

Both are told only beyond three standard errors and a least size; a simulated camera's noise is in the standard error.
A third, of a solver that takes forces at the begin of a step or moves by the speed at its end, is found by the
diagnosis of the simulation: it looks like one clock's offset where there are no clocks.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from station.physics.contact import GRAVITY_M_S2, Array
from station.signals.session import Signals
from station.simulators.recorded_runs import Poses, RecordedRun, poses_of, recorded_runs

LEAST_DEG, LEAST_MM = 0.1, 0.1
SIGNIFICANT = 3.0
LEAST_RUNS = 8
"""The least number of onsets in which a wave of four periods is sought."""
MOST_OF_WAVE = 0.5 * (1.0 - math.sqrt(0.5))
"""The amplitude of a pyramid's wave over its friction: at 45° it holds 1 / √2 of what it holds along the axes."""
_NEAR = 0.9
CURES = {
    "solver_creep": 'a smaller time step and a stiffer contact (MuJoCo: cone="elliptic", impratio="100")',
    "cone_artifact": 'an elliptic friction cone (MuJoCo: cone="elliptic")',
    "clock_offset": "forces taken amid each time step, or a smaller step",
}

MEANT = {
    ("solver_creep", "deg"): "blocks start earlier",
    ("solver_creep", "mm"): "blocks creep before they slide",
    ("cone_artifact", "deg"): "friction angles differ by direction",
    ("clock_offset", "s"): "paths are late against the tilt, or early where it is negative",
}
"""Words that say what the size of each is, by its unit."""


def artefacts(simulated: Signals, *, mu_s: float) -> list[dict[str, Any]]:
    """Returns the artefacts found: dicts of id, meant, size, unit, cured_by, before and after.

    `after` is None, as nothing is simulated again.

    Args:
        simulated: the signals of a recording that a simulator made.
        mu_s: the friction that was simulated.

    Raises:
        UserError: if it has no attitude, no track of the block or no run.
    """
    runs = [run for run in recorded_runs(simulated) if run.sample is not None and not run.velocity.any()]
    return [*_creep(simulated, runs, mu_s), *_cone(simulated, runs, mu_s)]


def _creep(simulated: Signals, runs: list[RecordedRun], mu_s: float) -> list[dict[str, Any]]:
    poses = poses_of(simulated)
    rows = [row for run in runs if (row := _drift(simulated, poses, run)) is not None]
    if len(rows) < 2:
        return []
    driven, moved = np.array(rows).T
    time_s = float(driven @ moved / (driven @ driven))
    left = moved - time_s * driven
    error = math.sqrt(float(left @ left) / (len(rows) - 1) / float(driven @ driven))
    crept_mm = 1e3 * time_s * float(driven.mean())
    if not (crept_mm > LEAST_MM and time_s > SIGNIFICANT * error):
        return []
    read = [run.sample.onset_angle_rad for run in runs if run.sample is not None and not run.sample.censored]
    found = [_said("solver_creep", crept_mm, "mm", crept_mm)]
    early_deg = math.degrees(math.atan(mu_s) - float(np.mean(read))) if read else 0.0
    if early_deg > LEAST_DEG:
        found.append(_said("solver_creep", early_deg, "deg", math.degrees(float(np.mean(read)))))
    return found


def _drift(simulated: Signals, poses: Poses, run: RecordedRun) -> tuple[float, float] | None:
    """Gives g ∫ sin θ dt (m/s) from the tilt's beginning to nine tenths of the onset, and the way down (m) by then."""
    sample = run.sample
    if sample is None:
        return None
    attitude = simulated.attitude.between(run.tilt_ns, run.end_ns)
    steep = np.flatnonzero(np.tan(attitude.tilt_rad) >= _NEAR * math.tan(sample.onset_angle_rad))
    if len(steep) == 0 or steep[0] < 2:
        return None
    until_ns = int(attitude.time_ns[steep[0]])
    before, during = poses.between(run.begin_ns, run.tilt_ns), poses.between(run.tilt_ns, until_ns)
    if not len(before.time_ns) or len(during.time_ns) < 4:
        return None
    gravity = attitude.gravity[: steep[0]]
    seconds = np.gradient((attitude.time_ns[: steep[0]] - run.tilt_ns) * 1e-9)
    driven = GRAVITY_M_S2 * (gravity[:, :2] * seconds[:, None]).sum(axis=0)
    size = float(np.linalg.norm(driven))
    # The last frames before the limit: a tenth of a second, and so a mean over the noise.
    last = during.pose[-max(4, min(9, len(during.pose))) :, :2].mean(axis=0)
    moved = last - before.pose[:, :2].mean(axis=0)
    return (size, float(moved @ driven) / size) if size > 0 else None


def _cone(simulated: Signals, runs: list[RecordedRun], mu_s: float) -> list[dict[str, Any]]:
    slid = [run.sample for run in runs if run.sample is not None and not run.sample.censored]
    if len(slid) < LEAST_RUNS:
        return []
    gravity = simulated.attitude.gravity_at(np.array([sample.slip_ns for sample in slid]))
    way = np.arctan2(gravity[:, 1], gravity[:, 0])
    ratio = np.tan([sample.onset_angle_rad for sample in slid]) / mu_s
    wave = np.cos(4.0 * way)
    fitted, error = _slope(wave, ratio)
    swing = float(np.ptp(wave)) * min(fitted, MOST_OF_WAVE)
    swing_deg = math.degrees(swing * mu_s / (1.0 + mu_s * mu_s))
    if not (swing_deg > LEAST_DEG and fitted > SIGNIFICANT * error):
        return []
    return [_said("cone_artifact", swing_deg, "deg", swing_deg)]


def _slope(by: Array, values: Array) -> tuple[float, float]:
    """Returns the slope of values (n,) by another quantity, and its standard error; (0, 0) where that does not vary."""
    off = by - by.mean()
    square = float(off @ off)
    if not square > 0.0:
        return 0.0, 0.0
    slope = float(off @ values) / square
    left = values - values.mean() - slope * off
    return slope, math.sqrt(float(left @ left) / max(len(values) - 2, 1) / square)


def _said(name: str, size: float, unit: str, before: float) -> dict[str, Any]:
    return said(name, size, unit, cured_by=CURES[name], before=before, after=None)


def said(
    name: str, size: float, unit: str, *, cured_by: str, before: float | None, after: float | None
) -> dict[str, Any]:
    """Returns an artefact as the answer has it; `meant` says in words what its size is of."""
    known = {"id": name, "meant": MEANT.get((name, unit), ""), "size": size, "unit": unit, "cured_by": cured_by}
    return known | {"before": before, "after": after}
