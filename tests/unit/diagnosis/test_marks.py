"""Marks on the plate, and on blocks at rest, seem to move by what a model says of the place where they lie."""

from __future__ import annotations

import numpy as np
import pytest

from station.diagnosis.observations.marks import PlateMarks
from station.diagnosis.observations.views import fixed_view
from station.physics.catalogue import catalogue
from station.physics.contact import View, middle
from station.physics.model import Model, Term
from tests.unit.diagnosis.recorded import golden
from tests.unit.diagnosis.test_image_rows import rows_for

COUNT = 24
DOWN_RAD = np.linspace(-3.0, 3.0, COUNT)
TILT_RAD = np.linspace(0.05, 0.4, COUNT)


def looked_at(point_m: np.ndarray, tilt_rad: np.ndarray) -> View:
    signals, rig = golden()
    assert signals.geometry is not None
    height_px = rig.camera.height_px
    return fixed_view(point_m, signals.geometry, image_height_px=height_px, tilt_rad=tilt_rad, down_rad=DOWN_RAD)


@pytest.mark.parametrize("lens", [-0.05, 0.05])
def test_a_sag_beside_a_lens_moves_a_mark_by_the_sag_alone(lens: float) -> None:
    """The lens shows a mark that lies still where it showed it before."""
    known = catalogue()
    sag, bent = known["camera_sag"], known["lens_distortion"]
    terms = (Term(sag, {**sag.neutral(), "shift_m": 1e-3}), Term(bent, {**bent.neutral(), "k1": lens}))
    model, level_rad = Model(mu_s=0.4, terms=terms), np.zeros(COUNT)
    lies = np.array([[0.05, 0.04], [0.06, 0.04], [0.06, 0.05], [0.05, 0.05]]) + np.zeros((COUNT, 1, 1))
    level, tilted = (lies + model.seen(looked_at(lies, tilt_rad)) for tilt_rad in (level_rad, TILT_RAD))
    start, view = looked_at(level, level_rad), looked_at(tilted, TILT_RAD)
    moved_m = (middle(tilted - level) * view.down).sum(axis=1)
    marks = PlateMarks(rows_for(COUNT), moved_m, view, start)
    assert np.abs(moved_m).max() > 1e-4
    assert marks.residual(model) == pytest.approx(0.0, abs=1e-9)
