"""A recorded session simulated twice, with a model before and one after: how far each is from the recording.

Each run's own draw of the friction is not known: with the mean model a run's error holds its scatter, too. So the same
is told with each run's own level, found by simulating again with the friction that moves its onset to the recorded one;
what is then left of the onset is what a level cannot repair within `LEVELLED` rounds (a run that never slid, say), and
of the path what the model has wrong about the slide.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from shared.errors import UserError
from shared.rig import RigConfig
from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.model import Model, Term
from station.physics.parameter import Parameter
from station.signals.session import Signals
from station.simulators.recorded_runs import Poses, RecordedRun, numbers, poses_of, recorded_runs
from station.simulators.simulator import Simulator, simulator

RUNS = 60
LEVELLED = 3
_LEVELS = (0.3, 3.0)


@dataclass(frozen=True, eq=False, kw_only=True)
class Errors:
    """Differences of a simulation from the recording, run by run (n,); nan where there is nothing to compare.

    `onset_deg` is simulated minus recorded; `path_mm` is the root mean square distance over the frames from the
    recorded onset to the run's end.
    """

    run: Array
    onset_deg: Array
    path_mm: Array

    def summary(self) -> dict[str, float | int | None]:
        """Root mean squares over the runs that have them."""
        return {
            "onset_rmse_deg": _rms(self.onset_deg),
            "path_rmse_mm": _rms(self.path_mm),
            "onset_bias_deg": float(np.nanmean(self.onset_deg)) if np.isfinite(self.onset_deg).any() else None,
            "onsets": int(np.isfinite(self.onset_deg).sum()),
            "paths": int(np.isfinite(self.path_mm).sum()),
        }


@dataclass(frozen=True, kw_only=True)
class Rerun:
    """The errors of a simulator in some runs with two models, and the same with each run's own level of friction."""

    engine: str
    runs: tuple[int, ...]
    before: Errors
    after: Errors
    before_own_level: Errors
    after_own_level: Errors

    def table(self) -> dict[str, Any]:
        """The table in the contract of `--json` under `fit.simulator_rerun`."""
        return {
            "engine": self.engine,
            "runs": len(self.runs),
            "before": self.before.summary() | {"own_level": self.before_own_level.summary()},
            "after": self.after.summary() | {"own_level": self.after_own_level.summary()},
        }


def rerun(
    recorded: Signals,
    before: Model,
    after: Model,
    *,
    rig: RigConfig,
    engine: str | Simulator = "mujoco",
    runs: int = RUNS,
    progress: Callable[[str], None] = lambda _: None,
) -> Rerun:
    """Simulates some runs, spread over the session, with two models.

    Args:
        recorded: the session.
        before: the model that was taken for granted.
        after: the one that was found.
        rig: sizes of block, plate and picture.
        engine: a simulator, or its name.
        runs: how many of the recorded runs at most.
        progress: is told what is being done.

    Raises:
        UserError: if the recording lacks what a simulation needs, or there is no such simulator.
    """
    if runs < 1:
        raise UserError(f"Expected at least one run to simulate again, got {runs}")
    own = simulator(engine) if isinstance(engine, str) else engine
    name = engine if isinstance(engine, str) else type(engine).__name__
    part = some_runs(recorded, runs)
    found = list[Errors]()
    for label, model in (("before", before), ("after", after)):
        progress(f"simulating {len(part.runs)} runs again in {name}, {label}")
        plain = own.repeat(part, model, rig=rig)
        found += [errors(part, plain), errors(part, _levelled(part, plain, model, rig=rig, engine=own))]
    return Rerun(
        engine=name,
        runs=part.runs,
        before=found[0],
        before_own_level=found[1],
        after=found[2],
        after_own_level=found[3],
    )


def some_runs(recorded: Signals, count: int) -> Signals:
    """The session with at most `count` of its runs that can be repeated, evenly spread; the tracks of these only.

    Raises:
        UserError: if the recording lacks what a simulation needs.
    """
    every = recorded_runs(recorded)
    if len(every) > count:
        places = np.unique(np.linspace(0, len(every) - 1, count).round().astype(int))
        every = tuple(every[place] for place in places.tolist())
    chosen = {run.run for run in every}
    events = recorded.events
    return replace(
        recorded,
        events=events.select(np.isin(events.run, sorted(chosen))),
        corners=_kept(recorded.corners, every),
        block=_kept(recorded.block, every),
        samples=tuple(sample for sample in recorded.samples if sample.run in chosen),
    )


def _kept(track: Any, runs: Sequence[RecordedRun]) -> Any:
    """The part of a track that is in one of the runs, from the reference to the end."""
    inside = np.zeros(len(track), dtype=bool)
    for run in runs:
        first, last = np.searchsorted(track.time_ns, (run.begin_ns, run.end_ns + 1))
        inside[first:last] = True
    return track.select(inside)


def errors(recorded: Signals, simulated: Signals) -> Errors:
    """The errors of a simulation of a recording."""
    runs = recorded_runs(recorded)
    seen, told = poses_of(recorded), poses_of(simulated)
    was, now = ({sample.run: sample for sample in each.samples} for each in (recorded, simulated))
    onset, path = np.full(len(runs), np.nan), np.full(len(runs), np.nan)
    for place, run in enumerate(runs):
        first, second = was.get(run.run), now.get(run.run)
        begin_ns = run.begin_ns
        if first is not None and second is not None and not run.velocity.any():
            if first.censored:
                continue
            begin_ns = first.slip_ns
            # The sample of a block that held has the steepest tilt: the error is at least as large.
            onset[place] = math.degrees(second.onset_angle_rad - first.onset_angle_rad)
        path[place] = _apart_mm(seen.between(begin_ns, run.end_ns), told.between(begin_ns, run.end_ns))
    return Errors(run=np.array([run.run for run in runs]), onset_deg=onset, path_mm=path)


def _apart_mm(seen: Poses, told: Poses) -> float:
    """Root mean square distance of two paths over the frames that both have; nan without any."""
    _, first, second = np.intersect1d(seen.time_ns, told.time_ns, return_indices=True)
    if not len(first):
        return math.nan
    away = seen.pose[first, :2] - told.pose[second, :2]
    return 1e3 * math.sqrt(float(np.mean(np.sum(away * away, axis=1))))


# --- each run's own level -------------------------------------------------------------------------------------------


class OwnLevel(Effect):
    """A factor on the friction of each run: no physics, but each run's random effect as it was."""

    id: ClassVar[str] = "own_level"
    title: ClassVar[str] = "each run's own level of friction"
    law: ClassVar[str] = "friction times a factor of the run (on = 0)"
    source: ClassVar[str] = "none: it is fitted to each run's onset"
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "history"
    parameters: ClassVar[tuple[Parameter, ...]] = (Parameter(name="on", unit="1", low=0.0, high=1.0, typical=1.0),)
    separated_by: ClassVar[str] = "nothing: it repairs every onset"

    def __init__(self, factor: Array) -> None:
        """Takes `factor` (m,) by the run's number, counted from 0 at the first of the runs."""
        self._factor = factor

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """The factor (n,) of each moment's run."""
        del values
        return self._factor[np.clip(np.rint(contact.run).astype(int), 0, len(self._factor) - 1)]


def _levelled(recorded: Signals, simulated: Signals, model: Model, *, rig: RigConfig, engine: Simulator) -> Signals:
    """The simulation repeated with the friction that moves each run's onset to the recorded one."""
    runs = [run for run in recorded_runs(recorded) if _has_onset(run)]
    if not runs:
        return simulated
    number = numbers(recorded_runs(recorded))
    place = {run.run: int(own) for run, own in zip(recorded_runs(recorded), number, strict=True)}
    factor = np.ones(max(place.values()) + 1)
    for _ in range(LEVELLED):
        for run in runs:
            factor[place[run.run]] *= _step(simulated, run)
        factor = np.clip(factor, *_LEVELS)
        own = model.with_term(Term(OwnLevel(factor), {"on": 1.0}))
        simulated = engine.repeat(recorded, own, rig=rig)
    return simulated


def _has_onset(run: RecordedRun) -> bool:
    return run.sample is not None and not run.sample.censored and not run.velocity.any()


def _step(simulated: Signals, run: RecordedRun) -> float:
    """The change of a run's friction that moves its onset to where it was recorded."""
    told = next((sample for sample in simulated.samples if sample.run == run.run), None)
    if told is None or run.sample is None:
        return 1.0
    # Of a block that held in the simulation, friction is known to be above the steepest tilt; the onset says so then.
    return math.tan(run.sample.onset_angle_rad) / max(math.tan(told.onset_angle_rad), 1e-3)


def by_engine(table: Mapping[str, Any]) -> str:
    """A line for a terminal with a simulator's errors before and after."""
    before, after = table["before"], table["after"]
    parts = [
        f"{name} {_number(before[key])} → {_number(after[key])} {unit}"
        for name, key, unit in (("onset", "onset_rmse_deg", "deg"), ("path", "path_rmse_mm", "mm"))
    ]
    return f"{table['engine']}, {table['runs']} runs: {', '.join(parts)} (root mean square)"


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"


def _rms(values: Array) -> float | None:
    known = values[np.isfinite(values)]
    return math.sqrt(float(np.mean(known * known))) if len(known) else None
