"""A session simulated again with the model before and after: errors against the recording."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import pytest

from shared.errors import UserError
from station.friction.onset import estimate_onset
from station.physics.model import Model
from station.signals.session import Signals
from station.simulators.errors import errors
from station.simulators.levelled import Slide
from station.simulators.recorded_runs import poses_of, recorded_runs
from station.simulators.rerun import Rerun, by_engine, only_runs, rerun, some_runs
from station.simulators.simulator import AS_IT_IS, RecordedSimulation, simulator
from tests.unit.simulators.test_planar_session import MU, golden, tossed, with_effect

DROP = 0.2


@cache
def truth() -> Signals:
    """The golden session as a block with a drop of friction would have done it."""
    recorded, rig = golden()
    return simulator("planar").repeat(recorded, with_effect("kinetic_drop", drop=DROP), rig=rig)


@cache
def again(engine: str) -> Rerun:
    right = with_effect("kinetic_drop", drop=DROP)
    return rerun(truth(), Model(mu_s=0.97 * MU), right, rig=golden()[1], engine=engine)


@pytest.mark.parametrize("engine", ["planar", "mujoco"])
def test_the_model_that_was_recorded_is_the_nearer_one(engine: str) -> None:
    table = again(engine).table()
    before, after = table["before"], table["after"]
    wrong_deg = math.degrees(math.atan(MU) - math.atan(0.97 * MU))
    assert before["onset_rmse_deg"] == pytest.approx(wrong_deg, abs=0.1)
    assert before["onset_bias_deg"] < 0
    assert after["onset_rmse_deg"] < 0.05
    assert after["path_rmse_mm"] < 0.5
    assert before["path_rmse_mm"] > 5.0
    assert (after["onsets"], after["paths"]) == (3, 3)
    assert table["engine"] == engine


@pytest.mark.parametrize("engine", ["planar", "mujoco"])
def test_each_runs_own_level_repairs_the_onset_and_not_the_slide(engine: str) -> None:
    before = again(engine).table()["before"]["own_level"]
    assert before["onset_rmse_deg"] < 0.02
    assert before["path_rmse_mm"] > 5.0


def test_a_slide_that_a_drag_slows_is_read_alike_in_both() -> None:
    """Its onset is read half a degree late: the right model would be far off at what it takes for the runs' level."""
    right = with_effect("viscous", drag_n_s_m=0.1)
    recorded = simulator("planar").repeat(golden()[0], right, rig=golden()[1])
    runs = [run for run in recorded_runs(recorded) if run.sample is not None]
    poses = poses_of(recorded)
    read = {run.run: Slide.of(recorded, poses, run, estimate_onset).onset_rad for run in runs}
    late = replace(recorded, samples=tuple(replace(one, onset_angle_rad=read[one.run]) for one in recorded.samples))
    path = [
        rerun(late, right, right, rig=golden()[1], engine="planar", reading=reading).table()["after"]["own_level"]
        for reading in (None, estimate_onset)
    ]
    assert path[0]["path_rmse_mm"] > 0.3
    assert path[1]["path_rmse_mm"] < 0.1


@pytest.mark.parametrize("times", [1.5, 1.8])
def test_blocks_that_held_in_the_simulation_come_down_to_their_levels(times: float) -> None:
    """The plates went no steeper than for the recorded friction, at which a larger one holds."""
    high = Model(mu_s=times * MU)
    plain = simulator("planar").repeat(truth(), high, rig=golden()[1])
    assert all(sample.censored for sample in plain.samples)
    right = with_effect("kinetic_drop", drop=DROP)
    table = rerun(truth(), high, replace(right, mu_s=times * MU), rig=golden()[1], engine="planar").table()
    assert table["before"]["own_level"]["onset_rmse_deg"] < 0.05
    assert table["before"]["own_level"]["path_rmse_mm"] > 5.0
    assert table["after"]["own_level"]["onset_rmse_deg"] < 0.05
    assert table["after"]["own_level"]["path_rmse_mm"] < 0.5


def test_what_a_simulation_made_of_itself_is_exact() -> None:
    found = errors(truth(), truth())
    assert found.onset_deg == pytest.approx([0.0, 0.0, 0.0])
    assert found.path_mm == pytest.approx([0.0, 0.0, 0.0])


def test_a_block_that_never_slides_is_no_better_for_it() -> None:
    held = rerun(truth(), Model(mu_s=1.5), Model(mu_s=MU), rig=golden()[1], engine="planar").table()
    assert held["before"]["onsets"] == 3
    assert held["before"]["onset_rmse_deg"] > held["after"]["onset_rmse_deg"]


def test_fewer_runs_are_spread_over_the_session() -> None:
    assert some_runs(truth(), 2).runs == (1, 3)
    part = rerun(truth(), Model(mu_s=MU), Model(mu_s=MU), rig=golden()[1], engine="planar", runs=2)
    assert part.runs == (1, 3)
    assert list(part.before.run) == [1, 3]


def test_of_a_recorded_simulation_its_own_runs_are_counted() -> None:
    fewer = only_runs(truth(), [1, 3])
    assert fewer is not None
    table = rerun(truth(), AS_IT_IS, AS_IT_IS, rig=golden()[1], engine=RecordedSimulation(fewer)).table()
    assert table["runs"] == table["before"]["onsets"] == 2


def test_tosses_have_paths_only() -> None:
    recorded, rig = tossed(0.2), golden()[1]
    wide = replace(rig, plate=replace(rig.plate, opening_m=4.0, side_m=4.0))
    table = rerun(recorded, Model(mu_s=0.1), Model(mu_s=0.2), rig=wide, engine="planar").table()
    assert table["before"]["onset_rmse_deg"] is None
    assert table["after"]["path_rmse_mm"] < 1.0 < table["before"]["path_rmse_mm"]
    assert "–" in by_engine(table)


def test_it_is_told_in_one_line() -> None:
    said = by_engine(again("planar").table())
    assert said.startswith("planar, 3 runs: onset 0.5")
    assert "→ 0.00 deg" in said


def test_no_runs_are_refused() -> None:
    with pytest.raises(UserError, match="at least one run"):
        rerun(truth(), Model(mu_s=MU), Model(mu_s=MU), rig=golden()[1], runs=0)
