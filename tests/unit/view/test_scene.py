"""Every topic is drawn or left out on purpose, and what is drawn says what the messages say."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun as rr
import rerun.blueprint as rrb

from shared import foxglove, frames
from shared import messages as m
from shared.rig import RigConfig
from shared.topics import TOPICS
from station.view import entities, shapes
from station.view.camera import CameraPart
from station.view.canvas import Canvas, Cap
from station.view.layout import layout
from station.view.part import Part, Rates
from station.view.plots import DisplacementPart, TiltPart
from station.view.reference import ReferenceTracker
from station.view.rrd import new_recording, write_rrd
from station.view.scene import NOT_SHOWN, SceneLogger
from station.view.session import SamplesPart
from station.view.setup import Setup, Threshold, setup_from_poses, setup_of
from tests.unit.view import session
from tests.unit.view.rrd_file import has_blueprint, rerun, rows_by_entity

NOW = session.START_NS
CORNERS = m.MarkerCorners(capture_ns=NOW, corners_px=tuple(session.corners_at(0).ravel().tolist()), found=True)
ONE_OF_EACH: dict[str, tuple[m.Message, str]] = {
    "camera/corners": (CORNERS, entities.CORNERS),
    "camera/plate": (CORNERS, entities.PLATE_MARK),
    "camera/image": (frames.image(session.picture(session.corners_at(0)), stamp_ns=NOW), entities.IMAGE),
    "camera/geometry": (session.GEOMETRY, entities.CAMERA),
    "camera/status": (m.AgentStatus(stamp_ns=NOW, fault="the cable is loose"), entities.EVENTS),
    "block/pose": (m.BlockPose(stamp_ns=NOW, z=0.005, found=True), entities.BLOCK),
    "arm/joints": (m.JointState(stamp_ns=NOW, name=("a",), position_rad=(0.1,)), entities.JOINTS),
    "arm/platform": (m.PlatformState(stamp_ns=NOW), entities.PLATFORM),
    "arm/command": (m.TiltCommand(stamp_ns=NOW, angle_rad=0.1), entities.COMMANDED),
    "arm/reply": (m.ArmReply(accepted=False, reason="out of reach"), entities.EVENTS),
    "arm/motion": (m.MotionReport(stamp_ns=NOW, begin_ns=NOW), entities.MOTION),
    "environment": (m.Environment(stamp_ns=NOW, temperature_c=21.0), entities.TEMPERATURE),
    "session/event": (m.RunEvent(stamp_ns=NOW, run=1, phase="TILT"), entities.PHASE),
    "session/sample": (session.sample(), entities.SAMPLES),
    "session/heartbeat": (m.Heartbeat(stamp_ns=NOW, armed=True), entities.STATION),
    "clock": (m.ClockOffset(stamp_ns=NOW, agent="camera", offset_ns=5), entities.CLOCK + "camera"),
    "tf": (frames.tf(frames.platform_transform(m.PlatformState(stamp_ns=NOW))), entities.PLATFORM),
    "log": (foxglove.Log(level=2, message="hello", name="arm"), entities.LOG + "arm"),
    "angle/imu": (m.AngleReading(stamp_ns=NOW, source="imu", angle_rad=0.2), entities.ANGLES + "imu"),
}
NEEDS_ANOTHER = {"camera/calibration": "camera/geometry"}
"""Drawn only together with another topic."""


def draw(path: Path, *items: tuple[str, m.Message, int], setup: Setup | None = None) -> dict[str, int]:
    write_rrd(items, path, topics=[item[0] for item in items], setup=setup or Setup(), name="test")
    return rows_by_entity(path)


def test_every_topic_of_the_table_is_drawn_or_left_out_on_purpose() -> None:
    drawn = set(ONE_OF_EACH) | set(NEEDS_ANOTHER) - {"angle/imu"}
    assert set(TOPICS) - drawn == NOT_SHOWN
    assert not NOT_SHOWN & drawn


def test_a_name_with_odd_letters_is_one_entity(tmp_path: Path) -> None:
    clock = m.ClockOffset(stamp_ns=NOW, agent="left/2", offset_ns=5)
    (entity,) = (name for name in draw(tmp_path / "odd.rrd", ("clock", clock, NOW)) if "/health/clock/" in name)
    assert entity.removeprefix("/health/clock/").replace("\\", "") == "left/2"
    assert "/" not in entity.removeprefix("/health/clock/").replace("\\/", "")


@pytest.mark.parametrize("topic", sorted(ONE_OF_EACH))
def test_a_message_of_each_topic_makes_its_entity(topic: str, tmp_path: Path) -> None:
    message, entity = ONE_OF_EACH[topic]
    before = draw(tmp_path / "empty.rrd")
    after = draw(tmp_path / "one.rrd", (topic, message, NOW))
    assert after.get("/" + entity, 0) > before.get("/" + entity, 0)


def test_calibration_places_the_camera_only_with_its_geometry(tmp_path: Path) -> None:
    k = np.array([[1700.0, 0, 300], [0, 1700, 300], [0, 0, 1]])
    calibration = frames.calibration(width_px=600, height_px=600, K=k, stamp_ns=NOW)
    alone = draw(tmp_path / "alone.rrd", ("camera/calibration", calibration, NOW))
    both = draw(
        tmp_path / "both.rrd", ("camera/calibration", calibration, NOW), ("camera/geometry", session.GEOMETRY, NOW)
    )
    assert "/" + entities.CAMERA not in alone
    assert both["/" + entities.CAMERA] == 1


def test_a_whole_session_gives_a_file_that_rerun_verifies_with_its_layout_inside(tmp_path: Path) -> None:
    path = tmp_path / "session.rrd"
    items = list(session.session_messages())
    drawn = write_rrd(
        items, path, topics={topic for topic, _, _ in items}, setup=setup_of(RigConfig(id="test")), name="test"
    )
    assert drawn.count == len(items)
    assert drawn.start_ns == session.START_NS
    assert drawn.refused == {}
    rerun("rrd", "verify", path)
    assert has_blueprint(path)
    rows = rows_by_entity(path)
    frames_seen = sum(topic == "camera/corners" for topic, _, _ in items)
    assert rows["/" + entities.THRESHOLD] == frames_seen + 1  # and its style
    assert rows["/" + entities.IMAGE] == sum(topic == "camera/image" for topic, _, _ in items)
    assert {"/" + entities.ARM, "/" + entities.FOAM, "/" + entities.TRAIL, "/" + entities.WAY} <= set(rows)


def test_poses_of_another_tracker_need_neither_camera_nor_arm(tmp_path: Path) -> None:
    rows = draw(tmp_path / "poses.rrd", *session.session_messages(camera=False, arm=False))
    assert rows["/" + entities.BLOCK] > 100
    assert rows["/" + entities.SLID] == rows["/" + entities.HEIGHT] + 1  # the gap at the reference
    assert not {"/" + entities.IMAGE, "/" + entities.ARM, "/" + entities.FOAM} & set(rows)


def test_two_loggers_share_one_recording_under_their_own_roots(tmp_path: Path) -> None:
    path = tmp_path / "two.rrd"
    recording = new_recording()
    recording.set_sinks(rr.FileSink(path))
    for root in ("recording/", "simulation/"):
        logger = SceneLogger(recording, setup=Setup(), root=root, start_ns=NOW)
        logger.log("camera/corners", CORNERS, NOW)
        logger.flush()
    recording.flush(timeout_sec=10.0)
    recording.disconnect()
    rows = rows_by_entity(path)
    assert rows["/recording/" + entities.CORNERS] == rows["/simulation/" + entities.CORNERS] > 0


def test_messages_that_make_no_sense_are_counted_and_not_drawn(tmp_path: Path) -> None:
    wrong = m.MarkerCorners(capture_ns=NOW, corners_px=(1.0, 2.0), found=True)
    upside = m.PlatformState(stamp_ns=NOW, qw=0.0)
    items = [("camera/corners", wrong, NOW), ("arm/platform", upside, NOW), ("camera/corners", CORNERS, NOW + 10**8)]
    path = tmp_path / "wrong.rrd"
    drawn = write_rrd(items, path, topics=[], setup=Setup(), name="test")
    assert set(drawn.refused) == {"camera/corners", "arm/platform"}
    only_good = draw(tmp_path / "good.rrd", items[-1])
    assert rows_by_entity(path)["/" + entities.CORNERS] == only_good["/" + entities.CORNERS]


def test_a_wanted_topic_is_one_that_some_part_takes() -> None:
    logger = SceneLogger(new_recording(), setup=Setup())
    assert logger.wants("camera/corners")
    assert logger.wants("angle/imu")
    assert not any(logger.wants(topic) for topic in NOT_SHOWN)


# --- the parts' own logic --------------------------------------------------------------------------------------------


class Board(Canvas):
    """A canvas that keeps what is logged, for tests."""

    def __init__(self) -> None:
        super().__init__(new_recording())
        self.logged: list[tuple[int, str, tuple[rr.AsComponents, ...]]] = []
        self.points: list[tuple[int, str, tuple[float, ...]]] = []

    def log(self, path: str, *archetypes: rr.AsComponents) -> None:
        self.logged.append((self.now_ns, path, archetypes))

    def curve(self, path: str, *values: float) -> None:
        self.points.append((self.now_ns, path, values))


def feed(board: Board, make: Callable[[Canvas, Setup, Rates], Part], *items: tuple[str, m.Message, int]) -> None:
    handlers = make(board, Setup(), Rates()).handlers()
    for topic, message, stamp_ns in items:
        if topic in handlers:
            board.at(stamp_ns)
            handlers[topic](message)


def test_displacement_crosses_the_threshold_where_the_paper_says() -> None:
    board = Board()
    feed(board, DisplacementPart, *session.session_messages())
    moved: dict[int, list[float]] = {}
    for stamp, path, values in board.points:
        if path in entities.DISPLACEMENT:
            moved.setdefault(stamp, []).append(values[0])
    limits = {stamp: values[0] for stamp, path, values in board.points if path == entities.THRESHOLD}
    crossing = min(stamp for stamp, values in moved.items() if sum(np.array(values) > limits[stamp]) >= 3)
    at_s = (crossing - session.START_NS) * 1e-9
    expected_px = 10.0 + math.degrees(session.tilt_at(at_s))
    assert limits[crossing] == pytest.approx(expected_px, abs=0.3)
    slid_px = np.linalg.norm(session.corners_at(at_s) - session.corners_at(0), axis=1)
    np.testing.assert_allclose(moved[crossing], slid_px, atol=1e-6)
    assert session.SLIP_S < at_s < session.SLIP_S + 0.3


def test_displacement_ends_with_the_run() -> None:
    board = Board()
    feed(board, DisplacementPart, *session.session_messages())
    for corner in entities.DISPLACEMENT:
        drawn = [values[0] for _, path, values in board.points if path == corner]
        assert math.isnan(drawn[-1])
        assert sum(map(math.isnan, drawn)) == 1


def test_each_corner_has_a_panel_of_its_own_with_the_threshold() -> None:
    """A block that does not turn moves its corners alike: in one panel three of the four curves are hidden."""
    views = layout({"camera/corners"}, setup=Setup()).root_container
    contents = [set(map(str, view.contents)) for view in _views(views) if view.origin == "plots/displacement"]
    assert contents == [{f"/{corner}", f"/{entities.THRESHOLD}"} for corner in entities.DISPLACEMENT]


def test_a_low_panel_of_a_corner_has_two_numbers() -> None:
    """The viewer numbers powers of ten alone there: an axis up to 80 px had a 0."""
    (low, high), *_ = {
        tuple(view.properties["ScalarAxis"].range.as_arrow_array().to_pylist()[0])
        for view in _views(layout({"camera/corners"}, setup=Setup()).root_container)
        if view.origin == "plots/displacement"
    }
    assert low == 0.0
    assert 100.0 < high < 150.0


@pytest.mark.parametrize("diagnosed", [False, True])
def test_no_legend_covers_a_curve_of_the_rig(diagnosed: bool) -> None:
    """Legends lay over the tilt and over the first corner; names say the colours."""
    root = layout({"camera/corners", "block/pose"}, setup=Setup(), diagnosed=diagnosed).root_container
    curves = [view for view in _views(root) if type(view) is rrb.TimeSeriesView and view.origin != "health"]
    assert len(curves) == 6
    assert not any(map(_has_legend, curves))
    said = " ".join(str(part.name) for part in _parts(root))
    assert re.search(r"measured \(blue\).*threshold of a slip \(red\)", said)
    assert "height (blue)" in said


def test_further_sensors_of_the_angle_have_a_legend() -> None:
    root = layout({"arm/platform", "angle/imu"}, setup=Setup()).root_container
    (tilt,) = (view for view in _views(root) if view.origin == "plots/tilt")
    assert _has_legend(tilt) is True


def test_beside_simulations_the_corners_stand_behind_the_slides() -> None:
    """The rows of marked stretches were cut at the lower edge."""
    root = layout({"camera/corners", "block/pose"}, setup=Setup(), diagnosed=True).root_container
    (slides,) = (view for view in _views(root) if view.origin == "plots/block")
    assert all(word in slides.name for word in ("recorded", "before", "after", "height"))
    (tabs,) = (part for part in _parts(root) if isinstance(part, rrb.Tabs) and slides in part.contents)
    assert sum(view.origin == "plots/displacement" for view in _views(tabs)) == 4


def _has_legend(view: Any) -> bool:
    return view.properties["PlotLegend"].visible.as_arrow_array().to_pylist()[0]


def _parts(part: Any) -> Iterator[Any]:
    """Every part of a layout."""
    yield part
    for inner in part.contents if isinstance(part, rrb.Container) else ():
        yield from _parts(inner)


def _views(part: Any) -> Iterator[Any]:
    """Every view of a layout's part."""
    if isinstance(part, rrb.View):
        yield part
    for inner in part.contents if isinstance(part, rrb.Container) else ():
        yield from _views(inner)


def test_corners_over_an_image_are_those_of_its_own_frame() -> None:
    board = Board()
    feed(board, CameraPart, *session.session_messages())
    images = [stamp for stamp, path, _ in board.logged if path == entities.IMAGE]
    outlines = {stamp for stamp, path, _ in board.logged if path == entities.CORNERS}
    assert outlines == set(images)


def test_corners_without_images_are_drawn_at_the_drawing_rate() -> None:
    board = Board()
    items = [item for item in session.session_messages() if item[0] != "camera/image"]
    feed(board, CameraPart, *items)
    outlines = {stamp for stamp, path, _ in board.logged if path == entities.CORNERS}
    assert 100 <= len(outlines) <= 30 * session.END_S + 1


def test_a_lost_mark_wipes_its_outline() -> None:
    board = Board()
    lost = m.MarkerCorners(capture_ns=NOW + 10**9, found=False, reason="no mark")
    feed(board, CameraPart, ("camera/corners", CORNERS, NOW), ("camera/corners", lost, NOW + 10**9))
    strips = [logged[0] for _, path, logged in board.logged if path == entities.CORNERS]
    outlines = [strip for strip in strips if isinstance(strip, rr.LineStrips2D)]
    assert [len(outline.strips) for outline in outlines if outline.strips is not None] == [1, 0]


def test_the_onset_stands_at_the_slip_not_where_the_sample_came() -> None:
    board = Board()
    feed(board, TiltPart, ("session/sample", session.sample(), NOW + 9 * 10**9))
    ((stamp, _, values),) = [point for point in board.points if point[1] == entities.ONSET]
    assert stamp == session.sample().slip_ns
    assert values[0] == pytest.approx(24.0)
    assert board.now_ns == NOW + 9 * 10**9


def test_censored_runs_have_no_onset_and_say_so_in_the_table() -> None:
    board = Board()
    censored = m.Sample(run=2, detect_ns=NOW, slip_ns=NOW, censored=True, onset_angle_rad=math.radians(67.5))
    feed(board, TiltPart, ("session/sample", censored, NOW))
    assert not board.points
    feed(board, SamplesPart, ("session/sample", censored, NOW))
    assert "none up to 67.50°" in _text(board)


def _text(board: Board) -> str:
    document = [logged[0] for _, path, logged in board.logged if path == entities.SAMPLES][-1]
    assert isinstance(document, rr.TextDocument)
    assert document.text is not None
    return str(document.text.as_arrow_array()[0].as_py())


def test_the_table_gives_mean_and_sd_by_direction_over_kept_runs_only() -> None:
    board = Board()
    angles = [20.0, 22.0, 24.0, 60.0]
    samples = [
        m.Sample(run=i, detect_ns=NOW + i, slip_ns=NOW, direction=1, onset_angle_rad=math.radians(angle))
        for i, angle in enumerate(angles)
    ]
    flagged = m.Sample(run=9, detect_ns=NOW, direction=1, onset_angle_rad=1.0, flags=("turned",))
    items = [("session/sample", sample, NOW) for sample in (*samples[:3], flagged)]
    feed(board, SamplesPart, *items)
    assert "| 1 | 3 | 22.00 ± 2.00° |" in _text(board)
    assert "turned" in _text(board)


@pytest.mark.parametrize(
    ("sigma_deg", "told"),
    [(0.02, "24.00 ± 0.02°"), (0.0123, "24.00 ± 0.01°"), (0.0007, "24.00 ± <0.01°"), (0.0, "24.00°")],
)
def test_an_onset_and_its_error_have_the_same_decimals(sigma_deg: float, told: str) -> None:
    board = Board()
    sample = replace(session.sample(), onset_sigma_rad=math.radians(sigma_deg))
    feed(board, SamplesPart, ("session/sample", sample, NOW))
    assert f"| {told} |".replace("<", r"\<") in _text(board)


def test_a_late_sample_does_not_show_a_phase_before_it_began() -> None:
    board = Board()
    late = m.RunEvent(stamp_ns=NOW + 5, run=1, phase="RETURN")
    feed(board, SamplesPart, ("session/event", late, NOW + 5), ("session/sample", session.sample(), NOW + 1))
    assert [stamp for stamp, path, _ in board.logged if path == entities.SAMPLES] == [NOW + 5, NOW + 5]


def test_reference_is_the_mean_over_its_phase_then_the_samples_own() -> None:
    tracker = ReferenceTracker()
    tracker.on_corners(CORNERS)
    assert tracker.corners_px is None
    tracker.on_event(m.RunEvent(phase="REFERENCE"))
    for shift in (-1.0, 1.0):
        moved = tuple(value + shift for value in CORNERS.corners_px)
        tracker.on_corners(m.MarkerCorners(corners_px=moved, found=True))
    tracker.on_event(m.RunEvent(phase="STEP_BEGIN"))
    tracker.on_event(m.RunEvent(phase="TILT"))
    tracker.on_corners(m.MarkerCorners(corners_px=(0.0,) * 8, found=True))
    assert tracker.corners_px is not None
    np.testing.assert_allclose(tracker.corners_px.ravel(), CORNERS.corners_px)
    tracker.on_sample(m.Sample(reference_corners_px=(7.0,) * 8))
    np.testing.assert_allclose(tracker.corners_px, 7.0)
    tracker.on_event(m.RunEvent(phase="DONE"))
    assert tracker.corners_px is None


def test_a_cap_goes_by_the_messages_time_and_survives_a_step_back() -> None:
    cap = Cap(10.0)
    passed = [cap.due(stamp) for stamp in range(0, 1_000_000_000, 11_111_111)]
    assert 9 <= sum(passed) <= 11
    assert cap.due(-5_000_000_000)
    assert all(Cap(None).due(0) for _ in range(3))


def test_the_threshold_is_the_papers_unless_the_plan_says_otherwise() -> None:
    assert Threshold().at(20.0) == 30.0
    assert Threshold(base_px=5.0, per_deg_px=0.5).at(20.0) == 15.0


def test_shapes_are_guessed_from_where_a_tossed_block_was() -> None:
    rest = [(0.01 * i, -0.02 * i, 0.0524) for i in range(50)]
    flight = [(0.1, 0.1, 0.3)] * 10
    setup = setup_from_poses([*flight, *rest])
    assert setup.block_size_m == pytest.approx((0.1048,) * 3)
    assert setup.plate_side_m / 2 > 0.98
    assert setup_from_poses([]) == Setup()


def test_setup_follows_the_rig_file() -> None:
    setup = setup_of(RigConfig(id="test"))
    assert setup.arm is not None
    assert setup.opening_m == RigConfig(id="test").plate.opening_m
    assert setup.look_at_m[2] > 0.1
    without = setup_of(RigConfig(id="test"), armed=False)
    assert without.arm is None
    assert without.opening_m is None


@pytest.mark.parametrize(
    ("outline_m", "hole_m2"),
    [
        ((), math.pi * 0.045**2),
        (((-0.03, -0.02), (0.03, -0.02), (0.03, 0.02), (-0.03, 0.02)), 0.0024),
        (((-0.04, -0.04), (0.04, -0.04), (0.04, 0.0), (0.0, 0.0), (0.0, 0.04), (-0.04, 0.04)), 0.0048),
    ],
)
def test_the_foam_leaves_out_its_opening(outline_m: tuple[tuple[float, float], ...], hole_m2: float) -> None:
    """The area of the top, and each wall's vertical sides."""
    setup = Setup(opening_m=0.09, opening_outline_m=outline_m)
    mesh = shapes.foam(setup, opening_m=0.09)
    corners = np.array(mesh.vertex_positions.as_arrow_array().to_pylist())  # type: ignore[union-attr]
    faces = np.array(mesh.triangle_indices.as_arrow_array().to_pylist())  # type: ignore[union-attr]
    triangles = corners[faces]
    areas = 0.5 * np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    top = np.all(triangles[:, :, 2] == np.float32(setup.foam_height_m), axis=1)
    assert np.abs(areas[top, 2]).sum() == pytest.approx(0.01 - hole_m2, rel=3e-3)
    assert np.abs(areas[~top, 2]).max() < 1e-12
