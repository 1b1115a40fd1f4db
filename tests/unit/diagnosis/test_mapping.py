"""A camera that is turned, or whose map is strained by a thousandth, is allowed for: no effect is told of it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from station.diagnosis.diagnose import examined
from station.diagnosis.likelihood.mapping import CAMERA_MAP
from station.diagnosis.observations.setting import Setting
from station.physics.catalogue import catalogue
from station.physics.contact import Array
from station.signals.session import Signals
from tests.unit.diagnosis import recorded

SETTING = Setting(opening_radius_m=recorded.OPENING_RADIUS_M)


def seen_by(change: Array) -> Signals:
    """The session without any effect, seen by a camera whose map to the plate is followed by `change` (3, 3)."""
    session = recorded.session()
    geometry = session.geometry
    assert geometry is not None
    homography = change @ np.reshape(geometry.plate_from_pixel, (3, 3))
    return replace(session, geometry=replace(geometry, plate_from_pixel=tuple(homography.ravel().tolist())))


def turned(turn_rad: float) -> Array:
    """A turn about the plate's normal."""
    change = np.eye(3)
    change[:2, :2] = [[math.cos(turn_rad), -math.sin(turn_rad)], [math.sin(turn_rad), math.cos(turn_rad)]]
    return change


def strained(xx: float, yy: float, xy: float, *, lean: float = 0.0) -> Array:
    """A strain, and a lean about y, 1/m."""
    return np.array([[1.0 + xx, xy, 0.0], [xy, 1.0 + yy, 0.0], [lean, 0.0, 1.0]])


@pytest.mark.parametrize("turn_deg", [-0.4, 0.2, 3.0])
def test_no_push_aside_is_told_of_it(turn_deg: float) -> None:
    said = examined(seen_by(turned(math.radians(turn_deg))), catalogue(), setting=SETTING)
    assert said.diagnosis.effects == ()
    assert said.diagnosis.located == ()
    assert said.diagnosis.global_p > 0.01
    assert said.found is not None
    values = {term.effect: term.values for term in said.found.search.model.model.terms}[CAMERA_MAP]
    assert math.degrees(values["turn_rad"]) == pytest.approx(turn_deg, abs=0.1)
    notes = [note for note in said.diagnosis.notes if "turned by" in note]
    assert len(notes) == (abs(turn_deg) > 1.0)


STRAINS = {
    "larger": strained(0.01, 0.01, 0.0),
    "wider than high": strained(0.001, -0.001, 0.0),
    "sheared": strained(0.0, 0.0, 0.001),
    "leaning": strained(0.0, 0.0, 0.0, lean=0.02),
}


@pytest.mark.parametrize("change", STRAINS.values(), ids=STRAINS)
def test_nothing_is_told_of_a_map_that_is_a_little_wrong(change: Array) -> None:
    said = examined(seen_by(change), catalogue(), setting=SETTING).diagnosis
    assert said.effects == ()
    assert said.global_p > 0.01
