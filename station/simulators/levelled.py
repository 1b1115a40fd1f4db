"""Repeats a session with each run's own level of friction: that with which its block sets off when it did.

An onset is read by tracing a slide back, and where a drag, say, slows the slide, it is read late: with simulated onsets
as they are, a perfect simulator of a drag of 0.05 N s/m was 1.4 mm off. So the simulated slides are read as the
recorded ones are, as far as these had gone when their slips were noticed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from shared.messages import Sample
from shared.rig import RigConfig
from station.physics.contact import Array
from station.physics.model import Model, Term
from station.signals.session import Signals
from station.signals.traced import FITTED_NS, LEAST_SIGMA_M, Traced, trace
from station.signals.tracks import Times
from station.simulators.own_level import OwnLevel
from station.simulators.recorded_runs import Poses, RecordedRun, numbers, poses_of, recorded_runs
from station.simulators.simulator import Simulator

MOST_ROUNDS, LEVEL = 8, 1e-3
"""Levels are sought in at most so many rounds, until each run's friction is known to this share: a thousandth is 0.02°
of an onset at 20°. The rig's sessions and the golden one needed one to seven.
"""
BEYOND = 1.1
"""A block that held is taken to have at least this factor on the friction of the steepest tilt, which may be hardly
above its recorded onset. It matters where all blocks hold: the paths of `station run --lockstep --samples 40 --seed
733300`, done again in the planar simulator with mu = 1 (`rerun.rerun`), were 12 mm off, and 25 mm without."""
_LEVELS = (0.3, 3.0)
LEAST_FRICTION = 1e-3
"""It guards a division."""


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
    index = {run.run: int(number) for run, number in zip(every, numbers(every), strict=True)}
    poses = poses_of(recorded)
    slides = [Slide.of(recorded, poses, run, reading) for run in runs]
    own = np.array([index[slide.run.run] for slide in slides])
    factor = np.ones(max(index.values()) + 1)
    for _ in range(MOST_ROUNDS):
        change = _changes(slides, simulated, factor[own], reading)
        level = np.clip(factor[own] * change, *_LEVELS)
        if np.abs(np.log(level / factor[own])).max() < LEVEL:
            break
        factor[own] = level
        simulated = engine.repeat(recorded, model.with_term(Term(OwnLevel(factor.copy()), {"on": 1.0})), rig=rig)
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


def _changes(slides: Sequence[Slide], simulated: Signals, factor: Array, reading: Traced | None) -> Array:
    """Returns the changes (r,) of the runs' friction that move their onsets to where they were recorded.

    `factor` (r,) are those on the friction of the simulation, which a block that held there does not tell: it is taken
    to be the usual one of the runs that slid, times the run's own factor.
    """
    poses, samples = poses_of(simulated), {sample.run: sample for sample in simulated.samples}
    there = [samples.get(slide.run.run) for slide in slides]
    pairs = [
        (math.nan, math.nan) if sample is None else _onsets(slide, sample, simulated, poses, reading)
        for slide, sample in zip(slides, there, strict=True)
    ]
    was, now = np.maximum(np.tan(np.array(pairs).T), LEAST_FRICTION)
    held = np.array([sample is not None and sample.censored for sample in there])
    slid = ~held & np.isfinite(now)
    usual = float(np.median(now[slid] / factor[slid])) if slid.any() else 0.0
    now[held] = np.maximum(usual * factor[held], BEYOND * now[held])
    return np.nan_to_num(was / now, nan=1.0)


def _onsets(
    slide: Slide, sample: Sample, simulated: Signals, poses: Poses, reading: Traced | None
) -> tuple[float, float]:
    """Returns a run's onset as recorded and as simulated, rad, both read alike where both can be.

    The onset of a block that held in the simulation is the steepest tilt.
    """
    assert slide.run.sample is not None
    read_rad = math.nan if sample.censored else _read_rad(slide, simulated, poses, reading)
    if math.isfinite(read_rad) and math.isfinite(slide.onset_rad):
        return slide.onset_rad, read_rad
    return slide.run.sample.onset_angle_rad, sample.onset_angle_rad


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
