"""`station replay`: what it writes, where it looks for the shapes, and what it says to bad requests."""

from __future__ import annotations

import argparse
from pathlib import Path

import pytest
from PIL import Image

from shared import messages as m
from shared.errors import UserError
from shared.system import desktop
from station.app import pictured, progress
from station.app.commands import replay
from station.recording.provenance import Provenance
from station.recording.reader import open_recording
from station.recording.writer import Recording
from station.view import viewer
from tests.unit.view import session
from tests.unit.view.mcap_file import write_mcap
from tests.unit.view.rrd_file import has_blueprint, rerun

RIG = 'id = "test"\n[plate]\nside_m = 0.2\n[block]\nsize_m = [0.02, 0.02, 0.02]\n'
PLAN = "[slip]\nbase_px = 6.0\nper_deg_px = 0.5\n"


def request(*words: str | Path) -> int:
    parser = argparse.ArgumentParser()
    replay.add_arguments(parser)
    return replay.run(parser.parse_args([str(word) for word in words]))


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    return write_mcap(tmp_path / "session.mcap", session.session_messages())


@pytest.fixture
def without_display(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(desktop, "has_display", lambda: False)


def recorded(path: Path, *, rig: str = "", plan: str = "", arm: bool = True) -> Path:
    origin = Provenance(rig_id="test", started_ns=session.START_NS, rig_toml=rig, plan_toml=plan)
    with Recording(path, provenance=origin) as file:
        for topic, message, stamp_ns in session.session_messages(camera=arm, arm=arm):
            file.write_message(topic, message, receive_ns=stamp_ns)
    return path


def test_the_view_is_written_beside_the_recording_with_its_layout(
    recording: Path, without_display: None, capsys: pytest.CaptureFixture[str]
) -> None:
    assert request(recording) == 0
    view = recording.with_suffix(".rrd")
    rerun("rrd", "verify", view)
    assert has_blueprint(view)
    assert f"rerun {view}" in capsys.readouterr().out


def test_a_long_drawing_tells_how_far_it_is(
    recording: Path, without_display: None, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(progress, "EVERY_S", 0.0)
    assert request(recording) == 0
    printed = capsys.readouterr()
    drawn = printed.out.splitlines()[1].partition(" ")[0]
    assert f"{drawn} of {drawn} messages drawn in " in printed.err


def test_a_display_gets_the_viewer_unless_it_is_not_wanted(
    recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[Path] = []
    monkeypatch.setattr(desktop, "has_display", lambda: True)
    monkeypatch.setattr(viewer, "open_file", opened.append)
    target = tmp_path / "other.rrd"
    request(recording, "--save", target)
    assert opened == [target]
    request(recording, "--save", target, "--no-viewer")
    assert opened == [target]


@pytest.mark.skipif(not viewer.can_draw_headless(), reason="no Vulkan driver: apt-get install mesa-vulkan-drivers")
def test_a_picture_is_drawn_without_complaints_and_without_a_view_of_the_whole_session(
    recording: Path, tmp_path: Path, without_display: None, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out.png"
    assert request(recording, "--screenshot", out) == 0
    assert capsys.readouterr().out == f"Picture: {out}\n"
    with Image.open(out) as picture:
        assert picture.size == (1600, 963)
    assert not recording.with_suffix(".rrd").exists()


def test_a_picture_needs_only_what_is_near_of_the_frequent_topics(tmp_path: Path) -> None:
    shift_ns = 100_000_000_000
    items = list(session.session_messages())
    later = [(topic, message, stamp_ns + shift_ns) for topic, message, stamp_ns in items]
    reader = open_recording(write_mcap(tmp_path / "long.mcap", [*items, *later]))
    near = [(item.topic, item.publish_ns) for item in pictured.near(reader, session.START_NS + shift_ns)]
    assert {stamp_ns >= session.START_NS + shift_ns for topic, stamp_ns in near if topic == "camera/corners"} == {True}
    assert sum(topic == "session/sample" for topic, _ in near) == 2
    assert (
        sum(topic == "camera/geometry" for topic, _ in near)
        == sum(topic == "camera/geometry" for topic, *_ in items) * 2
    )


def test_the_viewer_is_bound_to_the_loopback_address(monkeypatch: pytest.MonkeyPatch) -> None:
    commands: list[tuple[str, ...]] = []

    def popen(words: tuple[str, ...], **_: object) -> None:
        commands.append(words)

    monkeypatch.setattr(viewer.subprocess, "Popen", popen)
    viewer.open_file(Path("session.rrd"))
    viewer.open_stream("rerun+http://127.0.0.1:9876/proxy")
    for words in commands:
        assert words[1:3] == ("--bind", "127.0.0.1")
    assert len(commands) == 2


def test_shapes_and_threshold_come_from_the_recording_itself(tmp_path: Path) -> None:
    setup = replay.setup_for(open_recording(recorded(tmp_path / "a.mcap", rig=RIG, plan=PLAN)), rig_path=None)
    assert (setup.plate_side_m, setup.block_size_m) == (0.2, (0.02, 0.02, 0.02))
    assert setup.threshold.at(10.0) == 11.0
    assert setup.arm is not None


def test_a_recording_without_an_arm_has_none_drawn(tmp_path: Path) -> None:
    setup = replay.setup_for(open_recording(recorded(tmp_path / "a.mcap", rig=RIG, arm=False)), rig_path=None)
    assert (setup.arm, setup.opening_m, setup.plate_side_m) == (None, None, 0.2)


def test_a_given_rig_file_goes_before_the_recordings_own(tmp_path: Path) -> None:
    other = tmp_path / "other.toml"
    other.write_text('id = "other"\n[plate]\nside_m = 0.3\n')
    setup = replay.setup_for(open_recording(recorded(tmp_path / "a.mcap", rig=RIG)), rig_path=str(other))
    assert setup.plate_side_m == 0.3


def test_without_any_rig_file_the_block_is_as_large_as_its_height_says(tmp_path: Path) -> None:
    reader = open_recording(recorded(tmp_path / "a.mcap", arm=False))
    assert replay.setup_for(reader, rig_path=None).block_size_m == pytest.approx((session.SIDE_M,) * 3)


def test_messages_that_make_no_sense_are_reported(
    tmp_path: Path, without_display: None, caplog: pytest.LogCaptureFixture
) -> None:
    wrong = m.MarkerCorners(capture_ns=session.START_NS, corners_px=(1.0,), found=True)
    path = write_mcap(tmp_path / "wrong.mcap", [("camera/corners", wrong, session.START_NS)])
    assert request(path) == 0
    assert "/camera/corners holds payloads that are no messages of it" in caplog.text


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ((), "Expected a recording"),
        (("none.mcap",), "cannot be read"),
        (("FILE", "--bus", "--as", "cook"), "Expected some of camera, arm, twin, station"),
        (("FILE", "--rig", "no.toml"), "cannot be read"),
        (("FILE", "--save", "/proc/no.rrd"), "cannot be written"),
    ],
)
def test_bad_requests_are_named_in_one_sentence(recording: Path, words: tuple[str, ...], expected: str) -> None:
    with pytest.raises(UserError, match=expected):
        request(*(str(recording) if word == "FILE" else word for word in words))
