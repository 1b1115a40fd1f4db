"""Repeats a session with each run's own level of friction: that with which its block sets off when it did.

An onset is read by tracing a slide back, and where a drag, say, slows the slide, it is read late: with simulated onsets
as they are, a perfect simulator of a drag of 0.05 N s/m was 1.4 mm off. So the simulated slides are read as the
recorded ones are, as far as these had gone when their slips were noticed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from shared.rig import RigConfig
from station.physics.contact import Array
from station.physics.model import Model, Term
from station.signals.session import Signals
from station.signals.traced import FITTED_NS, LEAST_SIGMA_M, Traced, trace
from station.signals.tracks import Times
from station.simulators.own_level import OwnLevel
from station.simulators.recorded_runs import Poses, RecordedRun, numbers, poses_of, recorded_runs
from station.simulators.simulator import Simulator

LEVELLED = 3
"""The rounds in which the levels are found."""
_LEVELS = (0.3, 3.0)


def levelled(
    recorded: Signals, simulated: Signals, model: Model, *, rig: RigConfig, engine: Simulator, reading: Traced | None
) -> Signals:
    """Returns the simulation repeated with the friction that moves each run's onset to the recorded one.

    Without a `reading` the onsets are taken as both tell them.
    """
    every = recorded_runs(recorded)
    runs = [run for run in every if run.sample is not None and not run.sample.censored and not run.velocity.any()]
    if not runs:
        return simulated
    index = {run.run: int(own) for run, own in zip(every, numbers(every), strict=True)}
    poses = poses_of(recorded)
    slides = [Slide.of(recorded, poses, run, reading) for run in runs]
    factor = np.ones(max(index.values()) + 1)
    for _ in range(LEVELLED):
        poses = poses_of(simulated)
        for slide in slides:
            factor[index[slide.run.run]] *= _change(slide, simulated, poses, reading)
        factor = np.clip(factor, *_LEVELS)
        own = model.with_term(Term(OwnLevel(factor), {"on": 1.0}))
        simulated = engine.repeat(recorded, own, rig=rig)
    return simulated


@dataclass(frozen=True, eq=False)
class Slide:
    """A recorded slide: how far it had gone when it was noticed and its noise, m; its onset as read, rad, or nan."""

    run: RecordedRun
    gone_m: float
    sigma_m: float
    onset_rad: float

    @classmethod
    def of(cls, recorded: Signals, poses: Poses, run: RecordedRun, reading: Traced | None) -> Slide:
        """Returns the slide of a run that has a sample."""
        assert run.sample is not None
        time_ns, away_m = _away_m(poses, run)
        if not len(time_ns) or not time_ns[0] <= run.sample.detect_ns <= time_ns[-1]:
            return cls(run, math.nan, math.nan, math.nan)
        lying = away_m[time_ns <= run.tilt_ns]
        noise_m = float(np.std(lying)) if len(lying) else 0.0
        gone_m = float(np.interp(run.sample.detect_ns - time_ns[0], time_ns - time_ns[0], away_m))
        unread = cls(run, gone_m, max(noise_m, LEAST_SIGMA_M), math.nan)
        return replace(unread, onset_rad=_read_rad(unread, recorded, poses, reading))


def _change(slide: Slide, simulated: Signals, poses: Poses, reading: Traced | None) -> float:
    """Returns the change of a run's friction that moves its onset to where it was recorded."""
    assert slide.run.sample is not None
    sample = next((sample for sample in simulated.samples if sample.run == slide.run.run), None)
    if sample is None:
        return 1.0
    read_rad = math.nan if sample.censored else _read_rad(slide, simulated, poses, reading)
    if math.isfinite(read_rad) and math.isfinite(slide.onset_rad):
        return math.tan(slide.onset_rad) / max(math.tan(read_rad), 1e-3)
    # The friction of a block that held in the simulation is above the steepest tilt, which is its onset then.
    return math.tan(slide.run.sample.onset_angle_rad) / max(math.tan(sample.onset_angle_rad), 1e-3)


def _read_rad(slide: Slide, signals: Signals, poses: Poses, reading: Traced | None) -> float:
    """Returns the onset that is read in a slide as far as the recorded one had gone when it was noticed; else nan."""
    time_ns, away_m = _away_m(poses, slide.run)
    gone = np.flatnonzero(away_m >= slide.gone_m)
    if reading is None or not len(gone) or math.isnan(slide.gone_m):
        return math.nan
    last_ns = int(time_ns[gone[0]])
    seen = poses.between(max(slide.run.tilt_ns, last_ns - FITTED_NS), last_ns)
    plate = signals.attitude.between(int(seen.time_ns[0]), last_ns)
    x, y, _ = signals.attitude.gravity_at(np.array([last_ns]))[0]
    fit = trace(
        reading,
        seen.time_ns,
        seen.pose[:, :2],
        start_m=slide.run.start[:2],
        down=np.array([x, y]) / max(math.hypot(x, y), LEAST_SIGMA_M),
        tilt_ns=plate.time_ns,
        tilt_rad=plate.tilt_rad,
        sigma_m=slide.sigma_m,
    )
    return math.nan if fit is None else float(fit.angle_rad)


def _away_m(poses: Poses, run: RecordedRun) -> tuple[Times, Array]:
    """Returns times (n,), ns, and how far a run's block then is from where its run began (n,), m."""
    mine = poses.between(run.begin_ns, run.end_ns)
    return mine.time_ns, np.asarray(np.linalg.norm(mine.pose[:, :2] - run.start[:2], axis=1), dtype=np.float64)
