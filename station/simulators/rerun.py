"""A recorded session simulated twice, with a model before and one after: how far each is from the recording.

Each run's own draw of the friction is not known: with the mean model a run's error holds its scatter, too. So the same
is told with each run's own level, found by simulating again with the friction that moves its onset to the recorded one;
what is then left of the onset is what a level cannot repair within `LEVELLED` rounds (a run that never slid, say), and
of the path what the model has wrong about the slide.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
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
from station.simulators import figures
from station.simulators.recorded_runs import Poses, RecordedRun, numbers, poses_of, recorded_runs
from station.simulators.simulator import OwnFriction, Simulator, simulator

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

    def summary(self) -> dict[str, Any]:
        """Plain and robust figures over the runs that have them, and `se` with the standard error of each."""
        onset, path = self.onset_deg, self.path_mm
        found = {
            "onset_rmse_deg": figures.rms(onset),
            "path_rmse_mm": figures.rms(path),
            "onset_bias_deg": figures.mean(onset),
            "onset_median_deg": figures.median(np.abs(onset)),
            "path_median_mm": figures.median(path),
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
        """The errors of several parts of the session, in the order of their runs."""
        order = np.argsort(np.concatenate([part.run for part in parts]), kind="stable")
        return cls(
            **{
                name: np.concatenate([getattr(part, name) for part in parts])[order]
                for name in ("run", "onset_deg", "path_mm")
            }
        )


@dataclass(frozen=True, kw_only=True)
class Rerun:
    """The errors of a simulator in some runs with two models, and the same with each run's own level of friction.

    `held_out` is True if the models knew nothing of the runs in which they were tried. A simulator that cannot be told
    what was found has no errors after it and none at a level of the runs' own; `why` says so in one sentence.
    """

    engine: str
    runs: tuple[int, ...]
    before: Errors
    after: Errors | None = None
    before_own_level: Errors | None = None
    after_own_level: Errors | None = None
    held_out: bool = False
    why: str = ""

    def table(self) -> dict[str, Any]:
        """The table in the contract of `--json` under `fit.simulator_rerun`."""
        return {
            "engine": self.engine,
            "runs": len(self.runs),
            "held_out": self.held_out,
            "before": _told(self.before, self.before_own_level),
            "after": _told(self.after, self.after_own_level),
            **({"no_after": self.why} if self.why else {}),
        }


def _told(errors: Errors | None, own_level: Errors | None) -> dict[str, Any]:
    if errors is None:
        return {}
    return errors.summary() | ({} if own_level is None else {"own_level": own_level.summary()})


@dataclass(frozen=True, kw_only=True)
class Part:
    """Some runs of a session by their numbers, and the models to try in them."""

    runs: frozenset[int]
    before: Model
    after: Model


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
    every = (Part(runs=frozenset(recorded.runs), before=before, after=after),)
    return rerun_in_parts(recorded, every, rig=rig, engine=engine, runs=runs, progress=progress)


def rerun_in_parts(
    recorded: Signals,
    parts: Sequence[Part],
    *,
    rig: RigConfig,
    engine: str | Simulator = "mujoco",
    name: str = "",
    runs: int = RUNS,
    progress: Callable[[str], None] = lambda _: None,
) -> Rerun:
    """As `rerun`, each part of the session with its own two models: those of a fold may know nothing of its runs.

    A simulator with a friction of its own (`OwnFriction`) that cannot be told what was found is tried before it alone.
    `name` is the simulator's in the result.
    """
    if runs < 1:
        raise UserError(f"Expected at least one run to simulate again, got {runs}")
    own = simulator(engine) if isinstance(engine, str) else engine
    name = name or (engine if isinstance(engine, str) else type(engine).__name__)
    some = some_runs(recorded, runs)
    why = own.why_untold if isinstance(own, OwnFriction) else ""
    found: dict[str, list[Errors]] = {}
    for part in parts:
        chosen = only_runs(some, part.runs)
        if chosen is None:
            continue
        for label, model in (("before", part.before), ("after", part.after))[: 1 if why else 2]:
            progress(f"simulating {len(chosen.runs)} runs again in {name}, {label}")
            if label == "after" and part.after is part.before:
                found.setdefault(label, []).append(found["before"][-1])
                found.setdefault("after_own_level", []).append(found["before_own_level"][-1])
                continue
            plain = own.repeat(chosen, model, rig=rig)
            found.setdefault(label, []).append(errors(chosen, plain))
            if not why:
                level = errors(chosen, _levelled(chosen, plain, model, rig=rig, engine=own))
                found.setdefault(f"{label}_own_level", []).append(level)
    if not found:
        raise UserError("Expected runs that can be simulated again among those that were diagnosed, found none")
    joined = {label: Errors.joined(each) for label, each in found.items()}
    return Rerun(engine=name, runs=some.runs, held_out=len(parts) > 1, why=why, **joined)


def some_runs(recorded: Signals, count: int) -> Signals:
    """The session with at most `count` of its runs that can be repeated, evenly spread; the tracks of these only.

    Raises:
        UserError: if the recording lacks what a simulation needs.
    """
    every = recorded_runs(recorded)
    if len(every) > count:
        places = np.unique(np.linspace(0, len(every) - 1, count).round().astype(int))
        every = tuple(every[place] for place in places.tolist())
    return _with_runs(recorded, every)


def only_runs(recorded: Signals, wanted: Collection[int]) -> Signals | None:
    """The session with these of its runs that can be repeated; None if there are none."""
    every = [run for run in recorded_runs(recorded) if run.run in wanted]
    return _with_runs(recorded, every) if every else None


def _with_runs(recorded: Signals, every: Sequence[RecordedRun]) -> Signals:
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
    """The errors of a simulation of a recording, whose clock and rates may be others: each run counts from its begin.

    A run that the simulation lacks has none.
    """
    runs = recorded_runs(recorded)
    again = {run.run: run for run in recorded_runs(simulated)}
    seen, told = poses_of(recorded), poses_of(simulated)
    was, now = ({sample.run: sample for sample in each.samples} for each in (recorded, simulated))
    onset, path = np.full(len(runs), np.nan), np.full(len(runs), np.nan)
    for place, run in enumerate(runs):
        first, second, same = was.get(run.run), now.get(run.run), again.get(run.run)
        begin_ns = run.begin_ns
        if first is not None and second is not None and not run.velocity.any():
            if first.censored:
                continue
            begin_ns = first.slip_ns
            # The sample of a block that held has the steepest tilt: the error is at least as large.
            onset[place] = math.degrees(second.onset_angle_rad - first.onset_angle_rad)
        if same is not None:
            later_ns = same.tilt_ns - run.tilt_ns
            theirs = told.between(begin_ns + later_ns - STEP_NS, run.end_ns + later_ns + STEP_NS)
            path[place] = _apart_mm(seen.between(begin_ns, run.end_ns), theirs, later_ns=later_ns)
    return Errors(run=np.array([run.run for run in runs]), onset_deg=onset, path_mm=path)


STEP_NS = 200_000_000
"""Between simulated places farther apart in time the block is not looked for: a camera of 5 Hz shows no slide."""


def _apart_mm(seen: Poses, told: Poses, *, later_ns: int) -> float:
    """Root mean square distance of two paths at the frames of the first that the second has; nan without any."""
    times = seen.time_ns + later_ns
    if len(told.time_ns) < 2:
        return math.nan
    right = np.clip(np.searchsorted(told.time_ns, times), 1, len(told.time_ns) - 1)
    inside = (times >= told.time_ns[0]) & (times <= told.time_ns[-1])
    inside &= told.time_ns[right] - told.time_ns[right - 1] <= STEP_NS
    if not inside.any():
        return math.nan
    base = told.time_ns[0]
    known, wanted = (told.time_ns - base).astype(float), (times[inside] - base).astype(float)
    away = seen.pose[inside, :2] - np.column_stack([np.interp(wanted, known, told.pose[:, axis]) for axis in (0, 1)])
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


def _or_none(value: float) -> float | None:
    return value if math.isfinite(value) else None
