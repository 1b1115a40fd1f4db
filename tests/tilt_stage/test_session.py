"""A whole session in simulated time whose arm is the emulated stage at the other end of a pty, as a user has it."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("tty", reason="the emulated stage is on a pty, which Windows does not have")

from shared.clock import SIMULATION_EPOCH_NS
from shared.config import Table
from shared.rig import RigConfig
from station.app import assembly, recordings
from station.app.lockstep import Lockstep
from station.arm.agent import arm_agent
from station.arm.drivers._servo_lines import PER_DEGREE
from station.recording.reader import open_recording
from station.recording.writer import Recording
from station.sampling.plan import Plan
from tests.tilt_stage.emulated import EmulatedStage, Served, answering, opened

UNIT_RAD = math.pi / 180 / PER_DEGREE


class OnCable(Lockstep):
    """The simulated session with the stage's driver; plate and block of the twin go where the stage is."""

    def __init__(self, rig: RigConfig, plan: Plan, *, recording: Recording, pty: Served) -> None:
        super().__init__(rig, plan, recording=recording)
        self._pty = pty
        self._arm.close()
        options = Table({"port": pty.port, "level_by_hand": True})
        settings = replace(assembly.arm_settings(rig), driver="servo", armed=True, options=options)
        with answering(pty):
            self._arm = arm_agent(self.bus, settings)

    def _tick_arm(self, now_ns: int) -> None:
        self._pty.serve((now_ns - SIMULATION_EPOCH_NS) // 1_000_000)
        time.sleep(0.0003)  # the kernel hands the bytes on
        stage = self._pty.stage
        at, speed = UNIT_RAD * np.array(stage.at, float), UNIT_RAD * np.array(stage.speed, float)
        self.twin.world.set_target(at, speed, stamp_ns=now_ns)
        super()._tick_arm(now_ns)


def test_two_runs_are_recorded_with_the_stage_s_own_angles(tmp_path: Path) -> None:
    rig_file = tmp_path / "rig.toml"
    text = assembly.simulated_rig_path().read_text(encoding="utf-8")
    rig_file.write_text(text.replace('"jaco2_spherical"', '"tilt_stage_2"'), encoding="utf-8")
    rig, path = assembly.rig_from(str(rig_file)), tmp_path / "stage.mcap"
    plan = assembly.plan_from(None, samples=2, seed=3)
    origin = recordings.provenance(rig, plan, mode="lockstep", started_ns=SIMULATION_EPOCH_NS)
    with opened(EmulatedStage()) as pty, Recording(path, provenance=origin) as recording:
        outcome = OnCable(rig, plan, recording=recording, pty=pty).run()
    assert (outcome.samples, outcome.fault) == (2, "")
    reader = open_recording(path)
    assert [sample.run for sample in reader.samples()] == [1, 2]
    assert all(5 < math.degrees(sample.onset_angle_rad) < 50 for sample in reader.samples())
