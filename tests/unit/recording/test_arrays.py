"""A recording as arrays: the same numbers as message by message, in the order of capture, run by run."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shared.geometry import block_pose_of, corners_on_plate, downhill_of, matrix_from_quaternion, tilt_of
from shared.messages import (
    AngleReading,
    BlockPose,
    CameraGeometry,
    ClockOffset,
    MarkerCorners,
    MotionReport,
    PlatformState,
)
from station.recording.arrays import first_geometry, load_signals, run_signals
from station.recording.reader import open_recording
from station.recording.repair import copy_without
from station.recording.writer import Recording
from station.signals.session import Signals
from station.signals.tracks import AttitudeTrack, Track
from tests.unit.recording import session


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return session.record(tmp_path_factory.mktemp("arrays") / "a.mcap")


@pytest.fixture(scope="module")
def signals(path: Path) -> Signals:
    return load_signals(open_recording(path))


def arrays(value: object) -> Iterator[np.ndarray]:
    """Every array in the signals, in a fixed order."""
    if isinstance(value, np.ndarray):
        yield value
    elif isinstance(value, Signals | Track):
        for spec in dataclasses.fields(value):
            yield from arrays(getattr(value, spec.name))
    elif isinstance(value, dict):
        for key in sorted(value):
            yield from arrays(value[key])


def test_arrays_hold_the_messages(path: Path, signals: Signals) -> None:
    items = list(open_recording(path).messages({"camera/corners"}))
    assert signals.corners.time_ns.tolist() == [item.publish_ns for item in items]
    for place, item in list(enumerate(items))[::17]:
        message = item.message
        assert isinstance(message, MarkerCorners)
        assert signals.corners.corner_px[place].ravel().tolist() == list(message.corners_px)
        assert signals.corners.corner_time_ns[place].tolist() == [
            item.publish_ns + delay for delay in message.corner_dt_ns
        ]
        assert signals.geometry is not None
        assert signals.corners.pose(signals.geometry)[place] == pytest.approx(
            block_pose_of(message.corners_px, signals.geometry), abs=1e-12
        )
        assert signals.corners.on_plate(signals.geometry)[place] == pytest.approx(
            corners_on_plate(np.reshape(message.corners_px, (4, 2)), signals.geometry), abs=1e-15
        )


def test_the_block_is_where_it_was_put(signals: Signals) -> None:
    assert signals.geometry is not None
    pose = signals.corners.pose(signals.geometry)
    times = np.arange(180) / 90
    expected = np.array([session.block_place_m(1, t) for t in times] + [session.block_place_m(2, t) for t in times])
    assert pose[:, :2] == pytest.approx(expected, abs=1e-9)
    assert pose[:, 2] == pytest.approx(np.zeros(360), abs=1e-9)


def test_tilt_and_gravity_agree_with_the_geometry(signals: Signals) -> None:
    attitude = signals.attitude
    for place in range(0, len(attitude), 37):
        q = tuple(attitude.quaternion[place].tolist())
        assert attitude.tilt_rad[place] == pytest.approx(tilt_of(*q), abs=1e-14)
        down = -matrix_from_quaternion(q)[2]
        assert attitude.gravity[place] == pytest.approx(down, abs=1e-14)
        if attitude.tilt_rad[place] > 0.01:
            assert attitude.gravity[place, :2] / np.hypot(*attitude.gravity[place, :2]) == pytest.approx(
                downhill_of(*q), abs=1e-12
            )


def test_attitudes_between_two_readings(signals: Signals) -> None:
    start_ns = session.START_NS + 1_000_000_000
    times = start_ns + np.arange(0, 500_000_000, 1_234_567)
    expected = session.RATE_RAD_S * ((times - session.START_NS) * 1e-9 - 0.5)
    assert signals.attitude.tilt_at(times) == pytest.approx(expected, abs=1e-9)
    assert signals.attitude.gravity_at(times)[:, 0] == pytest.approx(np.sin(expected), abs=1e-9)
    flipped = dataclasses.replace(
        signals.attitude, quaternion=signals.attitude.quaternion * np.resize([1.0, -1.0, -1.0], 400)[:, None]
    )
    assert flipped.tilt_at(times) == pytest.approx(expected, abs=1e-9)


def test_without_attitude_there_is_nothing_to_interpolate() -> None:
    empty = np.empty((0, 4))
    track = AttitudeTrack(time_ns=np.array([], dtype=np.int64), quaternion=empty, rate_rad_s=empty, pivot_m=empty)
    with pytest.raises(ValueError, match="at least one attitude"):
        track.at([1])


def test_runs_are_cut_at_their_events(path: Path, signals: Signals) -> None:
    assert signals.runs == (1, 2)
    first = signals.run(1)
    assert [sample.run for sample in first.samples] == [1]
    assert set(first.events.run.tolist()) == {1}
    assert first.events.first("SLIP", run=1) == session.START_NS + int(session.ONSET_S * 1e9)
    assert first.events.first("SLIP", run=2) is None
    assert first.corners.time_ns.max() <= signals.span_ns(1)[1]
    assert first.corners.corner_px.base is not None, "views, not copies"
    with pytest.raises(KeyError, match="run 9"):
        signals.span_ns(9)
    around = dict(run_signals(open_recording(path), around_ns=0))
    for run, part in around.items():
        whole = signals.run(run)
        assert [sample.run for sample in part.samples] == [run]
        assert len(part.corners) in (len(whole.corners), len(whole.corners) - 1)
        assert np.array_equal(part.corners.corner_px, whole.corners.corner_px[: len(part.corners)])


def test_a_stretch_of_time(path: Path, signals: Signals) -> None:
    low, high = session.START_NS + 700_000_000, session.START_NS + 900_000_000
    part, expected = load_signals(open_recording(path), from_ns=low, to_ns=high), signals.between(low, high)
    assert len(part.corners) == 18
    for found, wanted in zip(arrays(part), arrays(expected), strict=True):
        assert np.array_equal(found, wanted, equal_nan=found.dtype.kind == "f")
    assert part.geometry == session.GEOMETRY


def test_the_truth_changes_no_array(path: Path, signals: Signals, tmp_path: Path) -> None:
    copy_without(path, tmp_path / "b.mcap", drop=lambda topic: topic.startswith("truth/"))
    stripped = load_signals(open_recording(tmp_path / "b.mcap"))
    for found, wanted in zip(arrays(stripped), arrays(signals), strict=True):
        assert repr(found.tolist()) == repr(wanted.tolist())
    assert stripped.samples == signals.samples


def test_a_geometry_at_its_defaults_is_no_calibration(tmp_path: Path) -> None:
    path, known = tmp_path / "a.mcap", replace(session.GEOMETRY, source="known")
    with Recording(path, provenance=session.provenance()) as recording:
        for second, geometry in enumerate((CameraGeometry(), known, CameraGeometry())):
            recording.write_message("camera/geometry", geometry, receive_ns=session.START_NS + second * 10**9)
    reader = open_recording(path)
    assert load_signals(reader).geometry == known
    assert load_signals(reader, from_ns=session.START_NS + 2 * 10**9).geometry == known
    assert first_geometry(reader) == known


def test_late_lost_and_other_messages(tmp_path: Path) -> None:
    start = session.START_NS
    path = tmp_path / "a.mcap"
    with Recording(path, provenance=session.provenance()) as recording:

        def put(topic: str, message: object, ms: int) -> None:
            recording.write_message(topic, message, receive_ns=start + ms * 1_000_000)  # pyright: ignore

        put("clock", ClockOffset(stamp_ns=start, agent="arm", offset_ns=2_000_000), 0)
        put("camera/corners", MarkerCorners(capture_ns=start + 20, seq=2, corners_px=(1.0,) * 8, found=True), 1)
        put("camera/corners", MarkerCorners(capture_ns=start + 10, seq=1, reason="dark"), 2)
        put("camera/plate", MarkerCorners(capture_ns=start + 10, marker_id=7, corners_px=(3.0,) * 8, found=True), 3)
        put("block/pose", BlockPose(stamp_ns=start + 5, x=0.5, qw=1.0, found=True), 4)
        put("block/pose", BlockPose(stamp_ns=start + 6, reason="hidden"), 5)
        put("angle/imu", AngleReading(stamp_ns=start + 7, source="imu", angle_rad=0.25, gravity_z=-1.0), 6)
        put("arm/motion", MotionReport(stamp_ns=start + 50, run=3, step=2, begin_ns=start, end_ns=start + 40), 60)
        put("arm/motion", MotionReport(stamp_ns=start + 50, run=3, step=3, begin_ns=start), 61)
        put("arm/platform", PlatformState(stamp_ns=start), 62)
    signals = load_signals(open_recording(path))
    assert signals.corners.seq.tolist() == [1, 2]
    assert np.isnan(signals.corners.corner_px[0]).all()
    assert signals.corners.seen().seq.tolist() == [2]
    assert list(signals.fiducials) == [7]
    assert signals.block.position_m[0, 0] == 0.5
    assert np.isnan(signals.block.position_m[1]).all()
    assert signals.angles["imu"].gravity.tolist() == [[0.0, 0.0, -1.0]]
    # The arm's clock is 2 ms behind the station's.
    assert (signals.motions.time_ns - start).tolist() == [2_000_000]
    assert (signals.motions.end_ns - start).tolist() == [2_000_040]
    assert signals.attitude.time_ns.tolist() == [start + 2_000_000]
    assert signals.geometry is None
    assert signals.runs == ()
