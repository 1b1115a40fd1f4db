"""Our rule for MuJoCo's tangents against MuJoCo's own contacts."""

from __future__ import annotations

import math

import numpy as np
import pytest

from station.export.mujoco_frame import ellipse_turn_rad, first_tangent, worst_turn_rad
from station.simulators.mujoco.bindings import mj

SCENE = """<mujoco><worldbody><body quat="{quat}"><geom type="box" size=".1 .1 .01" pos="0 0 -.01"/></body>
<body pos="{place}" quat="{quat}"><freejoint/><geom type="box" size=".005 .005 .005"/></body></worldbody></mujoco>"""


@pytest.mark.parametrize("tilt_deg", [0, 10, 29, 31, 50, 80])
@pytest.mark.parametrize("azimuth_deg", [0, 20, 45, 90, 135, 200, 270, 300])
def test_the_first_tangent_is_where_mujoco_lays_it(tilt_deg: float, azimuth_deg: float):
    tilt, azimuth = math.radians(tilt_deg), math.radians(azimuth_deg)
    quat, place = np.empty(4), np.empty(3)
    mj.mju_axisAngle2Quat(quat, np.array([math.cos(azimuth), math.sin(azimuth), 0.0]), tilt)
    mj.mju_rotVecQuat(place, np.array([0, 0, 0.00499]), quat)
    model = mj.MjModel.from_xml_string(SCENE.format(quat=text(quat), place=text(place)))
    data = mj.MjData(model)
    mj.mj_forward(model, data)
    assert data.ncon >= 4
    for frame in data.contact.frame.reshape(-1, 3, 3):
        normal, first = frame[0], frame[1]
        assert first == pytest.approx(first_tangent(normal), abs=1e-6)
        plate = np.empty(9)
        mj.mju_quat2Mat(plate, quat)
        x, y, _ = plate.reshape(3, 3).T @ first
        turn = (math.atan2(y, x) - math.pi / 2 - ellipse_turn_rad(tilt, azimuth)) / math.pi
        assert turn == pytest.approx(round(turn), abs=1e-5)


def text(values: np.ndarray) -> str:
    return " ".join(repr(float(value)) for value in values)


def test_the_ellipse_stays_where_the_plate_tilts_about_x_or_y_and_turns_elsewhere():
    for tilt in np.radians([5, 20, 29, 45]):
        assert ellipse_turn_rad(float(tilt), 0.0) == pytest.approx(0.0, abs=1e-9)
        assert ellipse_turn_rad(float(tilt), math.pi / 2) == pytest.approx(0.0, abs=1e-9)
    assert math.degrees(worst_turn_rad(math.radians(20))) == pytest.approx(1.8, abs=0.05)
    assert math.degrees(worst_turn_rad(math.radians(30))) == pytest.approx(4.1, abs=0.05)
    assert math.degrees(worst_turn_rad(math.radians(50))) > 45
