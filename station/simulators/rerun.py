"""A recorded session simulated twice, with a model before and one after: how far each is from the recording.

Each run's own draw of the friction is not known: with the mean model a run's error holds its scatter, too. So the same
is told with each run's own level, found by simulating again with the friction that moves its onset to the recorded one;
what is then left of the onset is what a level cannot repair within `MOST_ROUNDS` rounds (a run that never slid, say),
and of the path what the model has wrong about the slide.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from shared.errors import UserError
from shared.rig import RigConfig
from station.physics.model import Model
from station.signals.session import Signals
from station.signals.traced import Traced
from station.simulators.errors import Errors, errors
from station.simulators.levelled import levelled
from station.simulators.recorded_runs import RecordedRun, recorded_runs
from station.simulators.simulator import OwnFriction, Simulator, simulator

RUNS = 60


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
        """Returns the table in the contract of `--json` under `fit.simulator_rerun`."""
        return {
            "engine": self.engine,
            "runs": len(self.runs),
            "held_out": self.held_out,
            "before": _errors_table(self.before, self.before_own_level),
            "after": _errors_table(self.after, self.after_own_level),
            **({"no_after": self.why} if self.why else {}),
        }


def _errors_table(errors: Errors | None, own_level: Errors | None) -> dict[str, Any]:
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
    reading: Traced | None = None,
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
        reading: reads the onset of a slide from its path (see `levelled`).
        progress: is told what is being done.

    Raises:
        UserError: if the recording lacks what a simulation needs, or there is no such simulator.
    """
    every = (Part(runs=frozenset(recorded.runs), before=before, after=after),)
    return rerun_in_parts(recorded, every, rig=rig, engine=engine, runs=runs, reading=reading, progress=progress)


def rerun_in_parts(
    recorded: Signals,
    parts: Sequence[Part],
    *,
    rig: RigConfig,
    engine: str | Simulator = "mujoco",
    name: str = "",
    runs: int = RUNS,
    reading: Traced | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Rerun:
    """Does the same as `rerun` with two models for each part of the session: those of a fold know nothing of its runs.

    A simulator with a friction of its own (`OwnFriction`) that cannot be told what was found is tried before it alone.
    `name` is the simulator's in the result.
    """
    if runs < 1:
        raise UserError(f"Expected at least one run to simulate again, got {runs}")
    own = simulator(engine) if isinstance(engine, str) else engine
    name = name or (engine if isinstance(engine, str) else type(engine).__name__)
    some = some_runs(recorded, runs)
    why = own.why_not_rerun if isinstance(own, OwnFriction) else ""
    found, repeated = dict[str, list[Errors]](), set[int]()
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
            repeated |= set(plain.runs)
            found.setdefault(label, []).append(errors(chosen, plain))
            if not why:
                level = errors(chosen, levelled(chosen, plain, model, rig=rig, engine=own, reading=reading))
                found.setdefault(f"{label}_own_level", []).append(level)
    if not found:
        raise UserError("Expected runs that can be simulated again among those that were diagnosed, found none")
    joined = {label: Errors.joined(each) for label, each in found.items()}
    there = tuple(run for run in some.runs if run in repeated)  # a recorded simulation may have fewer
    return Rerun(engine=name, runs=there, held_out=len(parts) > 1, why=why, **joined)


def some_runs(recorded: Signals, count: int) -> Signals:
    """Gives the session with at most `count` of its runs that can be repeated, evenly spread; the tracks of these only.

    Raises:
        UserError: if the recording lacks what a simulation needs.
    """
    every = recorded_runs(recorded)
    if len(every) > count:
        indices = np.unique(np.linspace(0, len(every) - 1, count).round().astype(int))
        every = tuple(every[index] for index in indices.tolist())
    return _with_runs(recorded, every)


def only_runs(recorded: Signals, wanted: Collection[int]) -> Signals | None:
    """Returns the session with these of its runs that can be repeated; None if there are none."""
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
    """Returns the part of a track that is in one of the runs, from the reference to the end."""
    inside = np.zeros(len(track), dtype=bool)
    for run in runs:
        first, last = np.searchsorted(track.time_ns, (run.begin_ns, run.end_ns + 1))
        inside[first:last] = True
    return track.select(inside)


def by_engine(table: Mapping[str, Any]) -> str:
    """Returns a line for a terminal with a simulator's errors before and after."""
    before, after = table["before"], table["after"]
    parts = [
        f"{name} {_number(before[key])} → {_number(after[key])} {unit}"
        for name, key, unit in (("onset", "onset_rmse_deg", "deg"), ("path", "path_rmse_mm", "mm"))
    ]
    return f"{table['engine']}, {table['runs']} runs: {', '.join(parts)} (root mean square)"


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"
