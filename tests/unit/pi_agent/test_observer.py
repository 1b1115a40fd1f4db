import math

import numpy as np
import pytest

from pi_agent.calibration.model import geometry_message, nominal
from pi_agent.cameras import Frame
from pi_agent.marks import fiducial_places_mm
from pi_agent.observer import Observer
from pi_agent.synthetic_view import SyntheticView
from shared.geometry import block_pose_of, corners_on_plate
from shared.messages import CameraGeometry, MarkerCorners
from tests.unit.pi_agent.rigs import rig, scene

RIG = rig()
GEOMETRY = geometry_message(nominal(RIG, width_px=600, height_px=600), RIG, stamp_ns=0)
FRAME_NS = 11_111_111


def observed(count: int, *, plate_rate_hz: float = 15.0) -> tuple[list[MarkerCorners], list[MarkerCorners]]:
    config = rig(plate_rate_hz=plate_rate_hz)
    view = SyntheticView(config, rng=np.random.default_rng(3))
    observer = Observer(config, view.info, boot_id=7)
    block: list[MarkerCorners] = []
    plate: list[MarkerCorners] = []
    for number in range(count):
        frame = Frame(view.frame(scene(0.004, -0.006, 0.1), number * FRAME_NS), number * FRAME_NS, number)
        block.append(observer.block(frame))
        plate += observer.plate(frame)
    return block, plate


def test_the_block_is_where_the_twin_put_it():
    block, _ = observed(10)
    assert all(report.found and not report.reason for report in block)
    x, y, yaw = block_pose_of(block[-1].corners_px, GEOMETRY)
    assert (x, y) == pytest.approx((0.004, -0.006), abs=1e-5)
    assert yaw == pytest.approx(0.1, abs=2e-3)
    last = block[-1]
    assert (last.seq, last.capture_ns, last.boot_id, last.marker_id) == (9, 9 * FRAME_NS, 7, 0)
    assert last.exposure_ns == 2_000_000
    assert 0 < last.sigma_px < 0.1


def test_the_fiducials_are_told_apart_and_lie_where_the_rig_says():
    _, plate = observed(14)
    on_plate = CameraGeometry(plate_from_pixel=GEOMETRY.plate_from_pixel)
    places = {report.marker_id: report for report in plate if report.found}
    assert sorted(places) == [1, 2, 3, 4]
    for marker_id, report in places.items():
        centre = corners_on_plate(np.reshape(report.corners_px, (4, 2)), on_plate).mean(axis=0)
        expected = 1e-3 * np.array(fiducial_places_mm(RIG.plate)[marker_id - 1])
        np.testing.assert_allclose(centre, expected, atol=2e-5)


def test_every_fiducial_comes_at_its_rate_and_never_all_in_one_frame():
    _, plate = observed(90)
    for marker_id in (1, 2, 3, 4):
        assert sum(report.marker_id == marker_id for report in plate) == pytest.approx(15, abs=1)
    stamps = [report.capture_ns for report in plate]
    assert max(stamps.count(stamp) for stamp in stamps) == 1


def test_no_fiducials_are_looked_for_when_none_are_wanted():
    assert observed(3, plate_rate_hz=0.0)[1] == []


def test_an_empty_plate_is_said_and_carries_no_corners():
    view = SyntheticView(RIG, rng=np.random.default_rng(3))
    away = scene(0.2, 0.2)
    report = Observer(RIG, view.info).block(Frame(view.frame(away, 0), 0, 0))
    assert (report.found, report.corners_px, report.sigma_px) == (False, (), 0.0)
    assert report.reason


def test_a_tipping_block_is_flagged():
    view = SyntheticView(RIG, rng=np.random.default_rng(3))
    observer = Observer(RIG, view.info)
    reports: list[MarkerCorners] = []
    for number in range(30):
        lean = 0.0 if number < 20 else 0.35
        base = scene()
        tilted = type(base)(block_z_m=base.block_z_m, block_qw=math.cos(lean / 2), block_qy=math.sin(lean / 2))
        reports.append(observer.block(Frame(view.frame(tilted, 0), number * FRAME_NS, number)))
    assert not reports[19].tipped
    assert reports[-1].tipped
    assert reports[-1].corners_px
