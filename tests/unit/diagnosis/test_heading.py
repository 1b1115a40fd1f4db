"""A camera that is turned a little against the arm is allowed for, and no push aside is told of it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from station.diagnosis.diagnose import examined
from station.diagnosis.likelihood.heading import CAMERA_HEADING
from station.diagnosis.observations.setting import Setting
from station.physics.catalogue import catalogue
from station.signals.session import Signals
from tests.unit.diagnosis import recorded

SETTING = Setting(opening_radius_m=recorded.OPENING_RADIUS_M)


def seen_turned(turn_rad: float) -> Signals:
    """The session without any effect, seen by a camera that is turned by `turn_rad` about the plate's normal."""
    session = recorded.session()
    turn = np.eye(3)
    turn[:2, :2] = [[math.cos(turn_rad), -math.sin(turn_rad)], [math.sin(turn_rad), math.cos(turn_rad)]]
    geometry = session.geometry
    homography = turn @ np.reshape(geometry.plate_from_pixel, (3, 3))
    return replace(session, geometry=replace(geometry, plate_from_pixel=tuple(homography.ravel().tolist())))


@pytest.mark.parametrize("turn_deg", [-0.4, 0.2])
def test_no_push_aside_is_told_of_it(turn_deg: float) -> None:
    said = examined(seen_turned(math.radians(turn_deg)), catalogue(), setting=SETTING)
    assert said.diagnosis.effects == ()
    assert said.diagnosis.located == ()
    assert said.diagnosis.global_p > 0.01
    assert said.found is not None
    values = {term.effect: term.values for term in said.found.search.model.model.terms}[CAMERA_HEADING]
    assert math.degrees(values["turn_rad"]) == pytest.approx(turn_deg, abs=0.1)
