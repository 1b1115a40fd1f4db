"""A recorded session in the planar simulator: the same runs, seen by the same camera."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike

from shared.config import Table
from shared.errors import UserError
from shared.rig import RigConfig, rig_of_table
from station.physics.catalogue import catalogue
from station.physics.model import Model, Term
from station.recording.arrays import load_signals
from station.recording.reader import open_recording
from station.signals.session import Signals
from station.signals.tracks import AttitudeTrack, PoseTrack
from station.simulators.planar import batches, session
from station.simulators.planar.commands import Commands
from station.simulators.planar.session import commands_of
from station.simulators.planar.simulate import Chances, Motions, simulate
from station.simulators.recorded_runs import poses_of, recorded_runs, runs_on_a_plate
from station.simulators.simulator import RecordedSimulation, Simulator, names, simulator

GOLDEN = Path(__file__).parents[2] / "golden" / "session.mcap"
MU = 0.3464
"""The friction of the golden session's second run."""


@cache
def golden() -> tuple[Signals, RigConfig]:
    reader = open_recording(GOLDEN)
    text = reader.attachments["rig.toml"].decode()
    return load_signals(reader), rig_of_table(Table(tomllib.loads(text), "rig.toml", text))


@cache
def repeated(mu: float) -> Signals:
    recorded, rig = golden()
    return simulator("planar").repeat(recorded, Model(mu_s=mu), rig=rig)


def with_effect(name: str, **values: float) -> Model:
    effect = catalogue()[name]
    return Model(mu_s=MU, terms=(Term(effect, {**effect.neutral(), **values}),))


def test_runs_are_repeated_from_where_they_lay() -> None:
    recorded, _ = golden()
    runs = recorded_runs(recorded)
    assert [run.run for run in runs] == [1, 2, 3]
    for run, sample in zip(runs, recorded.samples, strict=True):
        assert run.start == pytest.approx([sample.start_x_m, sample.start_y_m, sample.start_yaw_rad], abs=2e-4)
        assert run.begin_ns < sample.slip_ns < run.end_ns <= run.until_ns
        assert run.rest_s > 0.3


def test_the_friction_that_was_measured_gives_the_onset_that_was_measured() -> None:
    recorded, rig = golden()
    for place, sample in enumerate(recorded.samples):
        own = simulator("planar").repeat(recorded, Model(mu_s=math.tan(sample.onset_angle_rad)), rig=rig).samples[place]
        assert own.onset_angle_rad == pytest.approx(sample.onset_angle_rad, abs=math.radians(0.02))
        assert own.slip_ns == pytest.approx(sample.slip_ns, abs=10e6)
        assert own.detect_ns == pytest.approx(sample.detect_ns, abs=100e6)
        assert (own.step_from_rad, own.step_to_rad) == (sample.step_from_rad, sample.step_to_rad)


def test_before_the_slide_the_corners_are_where_they_were() -> None:
    recorded, _ = golden()
    simulated = repeated(MU)
    slips = {sample.run: sample.slip_ns for sample in simulated.samples}
    assert recorded.geometry is not None
    for run in recorded_runs(recorded):
        own, seen = (
            each.corners.between(run.begin_ns, min(slips[run.run], run.end_ns)) for each in (simulated, recorded)
        )
        assert np.array_equal(own.time_ns, seen.time_ns)
        away = np.abs(own.corner_px - seen.corner_px)
        assert np.nanmedian(away) < 0.6
    assert np.isfinite(simulated.corners.corner_px[simulated.corners.found]).all()


def test_what_was_simulated_is_repeated_exactly() -> None:
    """A simulated session as the recording: its own model gives it back."""
    _, rig = golden()
    first = repeated(MU)
    again = simulator("planar").repeat(first, Model(mu_s=MU), rig=rig)
    for was, now in zip(first.samples, again.samples, strict=True):
        assert now.onset_angle_rad == pytest.approx(was.onset_angle_rad, abs=1e-9)
    assert np.nanmax(np.abs(first.corners.corner_px - again.corners.corner_px)) < 0.02


def test_a_block_that_holds_is_censored_at_the_steepest_tilt() -> None:
    recorded, _ = golden()
    for sample, run in zip(repeated(1.5).samples, recorded_runs(recorded), strict=True):
        steepest = recorded.attitude.between(run.begin_ns, run.end_ns).tilt_rad.max()
        assert sample.censored
        assert sample.slip_ns == 0
        assert sample.onset_angle_rad == pytest.approx(steepest)


def test_a_late_camera_stamps_late() -> None:
    recorded, rig = golden()
    late = simulator("planar").repeat(recorded, with_effect("clock_offset", delay_s=0.03), rig=rig)
    for was, now in zip(repeated(MU).samples, late.samples, strict=True):
        assert now.slip_ns - was.slip_ns == pytest.approx(30e6, abs=2)


def test_a_camera_that_sags_moves_the_mark_along_the_slope() -> None:
    recorded, rig = golden()
    shifted = simulator("planar").repeat(recorded, with_effect("camera_sag", shift_m=1e-3), rig=rig)
    run = recorded_runs(recorded)[1]
    at_ns = repeated(MU).samples[1].slip_ns - 50_000_000
    frames = slice(*np.searchsorted(recorded.corners.time_ns, (run.tilt_ns, at_ns)))
    away = (shifted.corners.corner_px - repeated(MU).corners.corner_px)[frames].mean(axis=1)
    tilt = recorded.attitude.tilt_at(recorded.corners.time_ns[frames])
    px_per_m = 6000.0 * 0.3 / 0.29
    assert np.linalg.norm(away, axis=1) == pytest.approx(1e-3 * px_per_m * np.sin(tilt), abs=1e-6)


def test_chance_is_drawn_when_a_generator_is_given() -> None:
    recorded, rig = golden()
    scattered = replace(Model(mu_s=MU), scatter=0.05)
    first, second, again = (
        simulator("planar").repeat(recorded, scattered, rig=rig, rng=np.random.default_rng(seed)) for seed in (1, 2, 1)
    )
    onsets = [[sample.onset_angle_rad for sample in each.samples] for each in (first, second, again)]
    assert onsets[0] == onsets[2] != onsets[1]
    assert len(set(onsets[0])) == 3
    noise = (first.corners.corner_px - again.corners.corner_px)[first.corners.found & again.corners.found]
    assert not noise.any()


def level(end_s: float) -> AttitudeTrack:
    times = np.arange(0.0, end_s, 0.01)
    return AttitudeTrack(
        time_ns=(times * 1e9).astype(np.int64),
        quaternion=np.tile([1.0, 0.0, 0.0, 0.0], (len(times), 1)),
        rate_rad_s=np.zeros((len(times), 3)),
        pivot_m=np.zeros((len(times), 3)),
    )


def tossed(mu: float) -> Signals:
    """One toss: a block that tumbles for 0.2 s, lands flat and slides to rest; seen by another tracker."""
    recorded, _ = golden()
    times = np.arange(0.0, 1.0, 0.01)
    sliding = np.clip(times - 0.2, 0.0, 0.5 / (mu * 9.81))
    way = 0.5 * sliding - 0.5 * mu * 9.81 * sliding**2
    lean = np.where(times < 0.2, 0.5, 0.0)
    empty = slice(0, 0)
    return replace(
        recorded,
        corners=recorded.corners.select(empty),
        commands=recorded.commands.select(empty),
        motions=recorded.motions.select(empty),
        events=replace(
            recorded.events.select(slice(0, 2)),
            time_ns=np.array([0, 990_000_000]),
            run=np.array([4, 4]),
            phase=np.array(["LEVEL", "DONE"]),
        ),
        attitude=level(1.0),
        samples=(replace(recorded.samples[0], run=4, block_mass_kg=0.37, block_area_m2=0.01),),
        geometry=None,
        block=PoseTrack(
            time_ns=(times * 1e9).astype(np.int64),
            position_m=np.column_stack([0.1 + 0.6 * way, 0.8 * way, np.full(len(times), 0.05)]),
            quaternion=np.column_stack([np.cos(lean / 2), np.sin(lean / 2), 0 * lean, 0 * lean]),
            sigma_m=np.zeros(len(times)),
            sigma_rad=np.zeros(len(times)),
            found=np.ones(len(times), dtype=bool),
        ),
    )


def test_a_toss_is_repeated_from_where_it_lies_flat() -> None:
    recorded, rig = tossed(0.2), golden()[1]
    wide = replace(rig, plate=replace(rig.plate, opening_m=4.0, side_m=4.0))
    run = recorded_runs(recorded)[0]
    assert run.begin_ns == pytest.approx(200_000_000, abs=10_000_001)
    assert run.velocity == pytest.approx([0.3, 0.4, 0.0], abs=0.01)
    simulated = simulator("planar").repeat(recorded, Model(mu_s=0.2), rig=wide)
    assert simulated.block.position_m == pytest.approx(recorded.block.position_m, abs=1e-3)
    assert simulated.block.quaternion == pytest.approx(recorded.block.quaternion, abs=1e-6)
    slippery = simulator("planar").repeat(recorded, Model(mu_s=0.1), rig=wide)
    assert slippery.block.position_m[-1, 0] > recorded.block.position_m[-1, 0] + 0.03


def test_a_recording_without_what_it_takes_says_so() -> None:
    recorded, rig = golden()
    blind = replace(recorded, geometry=None)
    for lacking, word in (
        (replace(recorded, attitude=recorded.attitude.select(slice(0, 0))), "attitude"),
        (blind, "track"),
    ):
        with pytest.raises(UserError, match=word):
            simulator("planar").repeat(lacking, Model(mu_s=MU), rig=rig)
    assert not len(poses_of(blind).time_ns)


@pytest.mark.parametrize("far_px", [1e6, 1e9])
def test_a_block_far_from_every_plate_is_not_repeated(far_px: float) -> None:
    """A slide from 1e294 m on was followed for hours."""
    recorded, _ = golden()
    second = recorded_runs(recorded)[1]
    gone = recorded.corners.time_ns >= second.begin_ns
    moved = np.where(gone[:, None, None], recorded.corners.corner_px + far_px, recorded.corners.corner_px)
    away = replace(recorded, corners=replace(recorded.corners, corner_px=moved))
    assert [run.run for run in runs_on_a_plate(away)] == [1]
    everywhere = replace(recorded, corners=replace(recorded.corners, corner_px=recorded.corners.corner_px + far_px))
    with pytest.raises(UserError, match="a block that lies on the plate"):
        runs_on_a_plate(everywhere)


def test_runs_whose_attitudes_fit_into_no_memory_are_refused() -> None:
    """A recording whose stamps were damaged asked for a tebibyte."""
    recorded, rig = golden()
    first, second, third = recorded_runs(recorded)
    late = replace(second, end_ns=second.begin_ns + 10**18)
    with pytest.raises(UserError, match=r"last 1667 s at most, to simulate 3 of them at once, got run 2 of 1e\+09 s"):
        commands_of(recorded, [first, late, third], rig=rig)


def test_a_run_that_fits_into_no_memory_is_refused_before_any_is_simulated() -> None:
    recorded, rig = golden()
    ends = recorded.events.time_ns.copy()
    ends[-1] += 10**13
    late = replace(recorded, events=replace(recorded.events, time_ns=ends))

    def simulated(*_given: object, **_named: object) -> Motions:
        raise AssertionError("a run was simulated")

    with pytest.raises(UserError, match=r"last 5000 s at most, to simulate 1 of them at once, got run 3 of 1e\+04 s"):
        session.repeated(late, Model(mu_s=MU), rig=rig, simulated=simulated)


def test_a_session_of_several_batches_is_simulated_as_one_of_one(monkeypatch: pytest.MonkeyPatch) -> None:
    recorded, rig = golden()
    scattered = replace(with_effect("wear", fall=0.2, runs=3.0), scatter=0.05)
    whole = simulator("planar").repeat(recorded, scattered, rig=rig, rng=np.random.default_rng(1))
    counts = list[int]()

    def simulated(commands: Commands, model: Model, *, time_s: ArrayLike, chances: Chances) -> Motions:
        counts.append(len(commands))
        return simulate(commands, model, time_s=time_s, chances=chances)

    monkeypatch.setattr(batches, "MOST_KNOTS", 1300)
    parts = session.repeated(recorded, scattered, rig=rig, rng=np.random.default_rng(1), simulated=simulated)
    assert counts == [1, 1, 1]
    assert parts.samples == whole.samples
    assert np.array_equal(parts.corners.corner_px, whole.corners.corner_px, equal_nan=True)


@pytest.mark.parametrize(
    ("moments", "slices"),
    [
        ((9, 9, 9), [(0, 3)]),
        ((2000, 9, 9), [(0, 1), (1, 3)]),
        ((9, 2000, 9), [(0, 1), (1, 2), (2, 3)]),
        ((9, 9, 1300), [(0, 2), (2, 3)]),
    ],
)
def test_a_batch_is_as_many_runs_as_fit_padded_to_its_longest(
    moments: tuple[int, ...], slices: list[tuple[int, int]], monkeypatch: pytest.MonkeyPatch
) -> None:
    runs = [replace(run, end_ns=run.begin_ns + 10**9) for run in recorded_runs(golden()[0])]
    monkeypatch.setattr(batches, "MOST_KNOTS", 1500)
    assert [(part.start, part.stop) for part in batches.batches(runs, np.array(moments))] == slices


def test_simulators_are_found_by_name() -> None:
    assert "planar" in names()
    assert isinstance(simulator("planar"), Simulator)
    with pytest.raises(UserError, match="planar"):
        simulator("bullet")


def test_a_recording_made_elsewhere_is_a_simulator() -> None:
    recorded, rig = golden()
    simulation = RecordedSimulation(repeated(MU))
    assert isinstance(simulation, Simulator)
    assert simulation.repeat(recorded, Model(mu_s=1.0), rig=rig) is repeated(MU)
    with pytest.raises(UserError, match="runs 4"):
        simulation.repeat(tossed(0.2), Model(mu_s=1.0), rig=rig)
