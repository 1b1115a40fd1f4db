"""A plate whose axes are not those of the picture is told, and no law of friction is sought in it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from station.diagnosis.answer import why_not
from station.diagnosis.observations.build import evidence_of
from station.diagnosis.observations.setting import Setting
from station.signals.downhill import DOWNHILL_RAD, usual_rad
from station.signals.session import Signals
from tests.unit.diagnosis import recorded


def turned(degrees: float) -> Signals:
    """A session whose arm says the tilt about an axis that is turned by so much."""
    signals = recorded.session()
    w, x, y, z = signals.attitude.quaternion.T
    cosine, sine = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    other = np.column_stack([w, cosine * x - sine * y, sine * x + cosine * y, z])
    return replace(signals, attitude=replace(signals.attitude, quaternion=other))


@pytest.mark.parametrize("degrees", [90.0, -90.0, 180.0])
def test_slides_across_or_up_the_plate_are_told(degrees: float) -> None:
    evidence = evidence_of(turned(degrees), Setting(opening_radius_m=recorded.OPENING_RADIUS_M))
    said = why_not(evidence) or ""
    assert said.startswith("expected blocks that slide down the plate, found most slides ")
    assert f"{abs(degrees):.0f}° off its steepest way down" in said


@pytest.mark.parametrize("degrees", [0.0, 10.0])
def test_slides_down_the_plate_are_not(degrees: float) -> None:
    evidence = evidence_of(turned(degrees), Setting(opening_radius_m=recorded.OPENING_RADIUS_M))
    assert why_not(evidence) is None


def test_the_usual_angle_is_the_median() -> None:
    way, down = np.array([[1.0, 0.0], [0.0, 2.0], [-3.0, 0.0]]), np.array([[5.0, 0.0], [1.0, 0.0], [1.0, 0.0]])
    assert usual_rad(way, down) == pytest.approx(0.5 * math.pi)
    assert usual_rad(np.zeros((0, 2)), np.zeros((0, 2))) == 0.0 < DOWNHILL_RAD
