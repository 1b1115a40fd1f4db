"""The UR5e that `station arm import` made: its kinematics are the maker's, and a session runs on it."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from station.__main__ import main as station
from station.recording.reader import open_recording
from station.rig.arm_model import Array, forward_kinematics, load_arm_model

# a (m), d (m), alpha (rad) of each joint, as Universal Robots publishes them for the UR5e.
DENAVIT_HARTENBERG = [
    (0.0, 0.1625, math.pi / 2),
    (-0.425, 0.0, 0.0),
    (-0.3922, 0.0, 0.0),
    (0.0, 0.1333, math.pi / 2),
    (0.0, 0.0997, -math.pi / 2),
    (0.0, 0.0996, 0.0),
]


def published(q: Array) -> Array:
    pose = np.diag([-1.0, -1.0, 1.0, 1.0])  # the controller's base frame is turned by half a turn
    for angle, (a, d, alpha) in zip(q, DENAVIT_HARTENBERG, strict=True):
        (st, ct), (sa, ca) = ((math.sin(x), math.cos(x)) for x in (float(angle), alpha))
        pose = pose @ np.array(
            [[ct, -st * ca, st * sa, a * ct], [st, ct * ca, -ct * sa, a * st], [0, sa, ca, d], [0, 0, 0, 1]]
        )
    return pose


def test_its_flange_is_where_the_maker_s_numbers_put_it() -> None:
    model = load_arm_model("ur5e")
    for q in np.random.default_rng(6).uniform(-math.pi, math.pi, (20, 6)):
        np.testing.assert_allclose(forward_kinematics(model, q), published(q), atol=1e-8)


def test_a_session_in_simulated_time_runs_on_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    own = Path("station/app/rigs/simulated.toml").read_text(encoding="utf-8")
    rig = tmp_path / "rig.toml"
    rig.write_text(own.replace('"jaco2_spherical"', '"ur5e"'), encoding="utf-8")
    out = tmp_path / "ur5e.mcap"
    assert station(["run", "--lockstep", "--rig", str(rig), "--samples", "2", "--seed", "1", "--out", str(out)]) == 0
    samples = open_recording(out).samples()
    assert len(samples) == 2
    assert all(3 < math.degrees(sample.onset_angle_rad) < 60 for sample in samples)
