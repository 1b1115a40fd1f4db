"""A lens that bends the picture, a shutter that rolls: places and times come out as without them."""

import dataclasses

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from shared.foxglove import CameraCalibration
from shared.geometry import corners_on_plate, mark_corners, pixels_of_mark
from shared.messages import CameraGeometry, MarkerCorners
from station.sampling import tracks as module
from station.sampling.plan import Plan
from station.sampling.tracks import Tracks
from tests.unit.sampling.scripted_rig import GEOMETRY, ScriptedRig

K = np.array([[1500.0, 0.0, 300.0], [0.0, 1500.0, 300.0], [0.0, 0.0, 1.0]])
LENS = (-0.35, 0.1, 0.0, 0.0, 0.0)


def test_a_bent_picture_gives_the_true_place():
    corners = mark_corners(side_m=0.01) + np.array([0.03, -0.025])
    straight = pixels_of_mark(corners, GEOMETRY)
    rays = np.column_stack([(straight - K[:2, 2]) / K[0, 0], np.ones(4)])
    seen: list[float] = cv2.projectPoints(rays, np.zeros(3), np.zeros(3), K, np.array(LENS))[0].ravel().tolist()
    tracks = Tracks(geometry=GEOMETRY)
    assert np.hypot(*(np.array(tracks.pose_of(tuple(seen))[:2]) - (0.03, -0.025))) > 1e-4
    tracks.lens = CameraCalibration(K=tuple(K.ravel().tolist()), D=LENS)
    assert tracks.pose_of(tuple(seen)) == pytest.approx((0.03, -0.025, 0.0), abs=1e-6)


def test_a_rolling_shutters_frames_take_the_time_of_their_corners():
    frame = MarkerCorners(1_000, 1, (1.0,) * 8, corner_dt_ns=(100, 100, 300, 300), found=True)
    tracks = Tracks(geometry=GEOMETRY)
    assert tracks.take_corners(frame, offset_ns=0)
    assert tracks.frame_ns == 1_000
    tracks.take_corners(dataclasses.replace(frame, capture_ns=5_000, corner_dt_ns=()), offset_ns=0)
    assert [stamp for stamp, _ in tracks._frames] == [1_200, 5_000]  # pyright: ignore[reportPrivateUsage]


def test_the_frames_of_a_slide_are_put_on_the_plate_once(monkeypatch: pytest.MonkeyPatch):
    """Onset and path were read off the same frames, each with a lens's distortion taken out anew."""
    counts: list[int] = []

    def counted(points: NDArray[np.float64], geometry: CameraGeometry) -> NDArray[np.float64]:
        counts.append(len(points))
        return corners_on_plate(points, geometry)

    monkeypatch.setattr(module, "corners_on_plate", counted)
    rig = ScriptedRig(Plan(samples=1), friction_rad=0.3)
    rig.run(60.0)
    assert len(rig.samples) == len(counts) == 1
