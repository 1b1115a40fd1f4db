"""Repeats a recorded session with the planar simulator."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shared.rig import RigConfig
from station.physics.contact import GRAVITY_M_S2, Array
from station.physics.model import Model
from station.signals.pivot import pivot_in_plate
from station.signals.session import Signals
from station.signals.tracks import AttitudeTrack
from station.simulators.planar.batches import batches, knots_s, require_short
from station.simulators.planar.commands import Commands, tracks
from station.simulators.planar.plate import Plate, gravity_at
from station.simulators.planar.simulate import Chances, Motions, simulate
from station.simulators.recorded_runs import RecordedRun, numbers, runs_on_a_plate
from station.simulators.simulated_signals import Outcome, simulated_signals

Integers = NDArray[np.int64]


class PlanarSession:
    """Repeats recorded sessions with the planar simulator."""

    def repeat(
        self, recorded: Signals, model: Model, *, rig: RigConfig, rng: np.random.Generator | None = None
    ) -> Signals:
        """Repeats the session as `Simulator.repeat` says."""
        return repeated(recorded, model, rig=rig, rng=rng)


class Simulate(Protocol):
    """Follows a batch of runs: `planar.simulate.simulate`, or another engine's that takes the same."""

    def __call__(self, commands: Commands, model: Model, *, time_s: ArrayLike, chances: Chances) -> Motions:
        """Follows the runs as `planar.simulate.simulate` does."""
        ...


def repeated(
    recorded: Signals,
    model: Model,
    *,
    rig: RigConfig,
    rng: np.random.Generator | None = None,
    simulated: Simulate = simulate,
) -> Signals:
    """Returns the session again, as `Simulator.repeat` says, with the engine `simulated`."""
    runs = runs_on_a_plate(recorded)
    for run in runs:
        require_short([run])
    number, chances = numbers(runs), Chances.none(len(runs))
    if rng is not None:
        chances = Chances.drawn(len(runs), scatter=model.scatter, rng=rng)

    def repeat(row: Integers, time_s: Array) -> Outcome:
        whole = _unknown(len(runs), len(row))
        for part in batches(runs, np.bincount(row, minlength=len(runs))):
            commands = replace(commands_of(recorded, runs[part], rig=rig), run=number[part])
            asked = (row >= part.start) & (row < part.stop)
            outcome = _outcome(
                commands,
                model,
                chances.rows(part),
                row=row[asked] - part.start,
                time_s=time_s[asked],
                simulated=simulated,
            )
            whole.onset_s[part], whole.onset_rad[part] = outcome.onset_s, outcome.onset_rad
            whole.pose[asked], whole.gravity[asked] = outcome.pose, outcome.gravity
        return whole

    return simulated_signals(recorded, runs, model, rig=rig, repeat=repeat, rng=rng)


def _unknown(runs: int, moments: int) -> Outcome:
    onset_s, onset_rad = np.full((2, runs), np.nan)
    pose, gravity = np.full((2, moments, 3), np.nan)
    return Outcome(onset_s=onset_s, onset_rad=onset_rad, pose=pose, gravity=gravity)


def commands_of(recorded: Signals, runs: Sequence[RecordedRun], *, rig: RigConfig) -> Commands:
    """Returns the commands of the runs.

    They have the attitude every 10 ms, and the specimen as its sample, or the rig file, has it.

    Raises:
        UserError: if they are so long that their attitudes do not fit into memory.
    """
    require_short(runs)
    size = rig.block.size_m
    samples = [run.sample for run in runs]
    times = [knots_s(run) for run in runs]
    stamps = [run.begin_ns + np.round(own * 1e9).astype(np.int64) for run, own in zip(runs, times, strict=True)]
    return tracks(
        times,
        [recorded.attitude.gravity_at(own) for own in stamps],
        pivot_m_s2=_pivot(recorded.attitude, stamps),
        border_m=0.5 * rig.plate.opening_m,
        outline_m=rig.plate.opening_outline_m,
        start=np.stack([run.start for run in runs]),
        velocity=np.stack([run.velocity for run in runs]),
        rest_s=[run.rest_s for run in runs],
        run=numbers(runs),
        mass_kg=[(sample and sample.block_mass_kg) or rig.block.mass_kg for sample in samples],
        area_m2=[(sample and sample.block_area_m2) or size[0] * size[1] for sample in samples],
        mount_rad=[sample.plate_mount_rad if sample else np.radians(rig.plate.mount_deg) for sample in samples],
        temperature_c=[sample.temperature_c if sample else np.nan for sample in samples],
        relative_humidity=[sample.relative_humidity if sample else np.nan for sample in samples],
    )


def _pivot(attitude: AttitudeTrack, stamps: Sequence[Integers]) -> list[Array] | None:
    """Returns the pivot's acceleration (k_i − 1, 3) in P, m/s², midway between the stamps of each run.

    It is None where it is not known.
    """
    known = attitude.known()
    origin_ns = known.time_ns[0]
    time_s = (known.time_ns - origin_ns) * 1e-9
    found = pivot_in_plate(known, time_s)
    if found is None:
        return None
    between_s = [(own[:-1] + np.diff(own) // 2 - origin_ns) * 1e-9 for own in stamps]
    return [np.column_stack([np.interp(own, time_s, column) for column in found.T]) for own in between_s]


def _outcome(
    commands: Commands,
    model: Model,
    chances: Chances,
    *,
    row: Integers,
    time_s: Array,
    simulated: Simulate,
) -> Outcome:
    """Simulates the runs once; moments (q,) of runs `row` (q,) in whatever order."""
    order = np.argsort(row, kind="stable")
    counts = np.bincount(row, minlength=len(commands))
    column = np.empty(len(row), dtype=np.int64)
    column[order] = np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)
    stamps = np.zeros((len(commands), int(counts.max(initial=1))))
    stamps[row, column] = time_s
    motions = simulated(commands, model, time_s=stamps, chances=chances)
    return Outcome(
        onset_s=motions.onset_s + model.delay_s(),
        onset_rad=motions.onset_rad,
        pose=motions.path[row, column],
        gravity=_true_gravity(commands, model, row, time_s),
    )


def _true_gravity(commands: Commands, model: Model, row: Integers, time_s: Array) -> Array:
    """Returns gravity (q, 3) in the plate as it truly stands; after a run's end as it stood then."""
    plate = Plate(commands, model)
    time_s = np.clip(time_s, 0.0, commands.end_s[row])
    number = np.empty(len(row), dtype=np.intp)
    for run in range(len(commands)):
        mine = row == run
        number[mine] = np.searchsorted(commands.time_s[run], time_s[mine], side="right") - 1
    number = np.clip(number, 0, plate.knots - 2)
    down = gravity_at(plate.stretch(row, number), time_s)
    return np.column_stack([down.x, down.y, down.z]) / GRAVITY_M_S2
