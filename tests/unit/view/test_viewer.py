"""The viewer itself, drawn without a display: no view complains, and the picture shows what it should."""

from __future__ import annotations

import io
import time
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image
from rerun.experimental import ViewerClient

from shared.errors import UserError
from shared.rig import RigConfig
from station.recording.provenance import Provenance
from station.recording.writer import Recording
from station.view import colours, viewer
from station.view.rrd import write_rrd
from station.view.setup import Setup, setup_of
from tests.unit.view import session
from tests.unit.view.mcap_file import write_mcap
from tests.unit.view.rrd_file import rerun, rows_by_entity

needs_vulkan = pytest.mark.skipif(
    not viewer.can_draw_headless(), reason="no Vulkan driver: apt-get install mesa-vulkan-drivers"
)


@pytest.mark.parametrize("camera", [True, False], ids=["camera", "poses"])
@needs_vulkan
def test_no_view_complains_and_none_is_missing(camera: bool, tmp_path: Path) -> None:
    path = tmp_path / "session.rrd"
    items = list(session.session_messages(camera=camera, arm=camera))
    setup = setup_of(RigConfig(id="test")) if camera else Setup()
    write_rrd(items, path, topics={topic for topic, _, _ in items}, setup=setup, name="test")
    with viewer.headless(size=(1200, 800)) as client:
        state = viewer.show(client, path, at_s=session.SLIP_S + 0.15)
        views = {view.name: view for view in state.views}
        picture = _pixels(client)
        panels = [views.get(f"Corner {number} (px)") for number in range(4)] if camera else []
        curves = [_pixels(client, panel.view_id) for panel in panels if panel is not None]
    assert {name: view.reports for name, view in views.items() if view.reports} == {}
    assert {view.view_class for view in views.values()} >= {
        "3D",
        "TimeSeries",
        "StateTimeline",
        "TextLog",
        "TextDocument",
    }
    assert any(view.view_class == "2D" for view in views.values()) == camera
    assert len(curves) == len(panels)
    for curve, corner in zip(curves, colours.CORNERS, strict=False):
        assert _near(curve, corner).sum() > 50
    if camera:
        assert _near(picture, colours.MARK).sum() > 50
        assert _near(picture, colours.REFERENCE).sum() > 50
    assert _near(picture, colours.PHASES["SLIP"]).sum() > 50


def _near(picture: np.ndarray, colour: colours.Colour) -> np.ndarray:
    return np.abs(picture - np.array(colour)).max(axis=-1) < 40


def test_plain_rerun_takes_image_corners_transforms_and_log_from_the_recording_itself(tmp_path: Path) -> None:
    recording = write_mcap(tmp_path / "session.mcap", session.session_messages())
    converted = tmp_path / "converted.rrd"
    rerun("mcap", "convert", recording, "-o", converted)
    rerun("rrd", "verify", converted)
    text = rerun("rrd", "print", "-v", converted)
    for component in (
        "/camera/image@EncodedImage:blob",
        "/camera/image/overlay@Points3D:positions",
        "/camera/calibration@Pinhole:image_from_camera",
        "/tf@Transform3D:translation",
        "/log@TextLog:text",
    ):
        assert component in text
    assert {"/camera/image", "/camera/image/overlay", "/tf", "/log", "/arm/joints"} <= set(rows_by_entity(converted))


@needs_vulkan
def test_plain_rerun_shows_arm_plate_block_camera_tilt_and_state_unaided(tmp_path: Path) -> None:
    """The picture is made from the file alone, with a block large enough to be seen, at the end of the slide."""
    rig = 'id = "test"\n[plate]\nside_m = 0.3\nopening_m = 0.28\n[block]\nsize_m = [0.1, 0.1, 0.1]\n'
    path = tmp_path / "session.mcap"
    with Recording(path, provenance=Provenance(rig_id="test", started_ns=session.START_NS, rig_toml=rig)) as file:
        for topic, message, stamp_ns in session.session_messages():
            file.write_message(topic, message, receive_ns=stamp_ns)
    with viewer.headless(size=(1200, 800)) as client:
        client.open(str(path))
        state = client.get_state()
        for _ in range(100):
            state = client.get_state()
            if len(state.views) >= 5 and not state.loading:
                break
            time.sleep(0.1)
        client.set_time("message_publish_time", timestamp=session.START_NS * 1e-9 + session.SLIP_S, play_state="paused")
        time.sleep(1.0)
        views = {view.view_class: view for view in client.get_state().views}
        scene, image = (_pixels(client, views[name].view_id) for name in ("3D", "2D"))
    assert {view.name: view.reports for view in views.values() if view.reports} == {}
    assert sorted(views) == ["2D", "3D", "TextDocument", "TextLog", "TimeSeries"]
    assert views["TextDocument"].name == "session/state"  # and not the robot's description
    assert _near(image, colours.MARK).sum() > 50
    red, green, blue = scene[..., 0], scene[..., 1], scene[..., 2]
    assert ((red > green + 25) & (green > blue + 15)).sum() > 50  # the block is the one orange thing
    grey = ((blue > 60) & (abs(red - green) < 12))[60:]  # arm and plate, without the view's heading
    assert grey.sum() > 1000
    _, _, parts, _ = cv2.connectedComponentsWithStats(grey.astype(np.uint8))
    # In one piece, but for a corner of the plate behind the block; of an arm in pieces the largest is a third.
    assert parts[1:, cv2.CC_STAT_AREA].max() > 0.75 * grey.sum()


def _pixels(client: ViewerClient, view_id: str | None = None) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(viewer.picture_of(client, view_id))).convert("RGB")).astype(int)


@needs_vulkan
def test_the_window_s_own_bar_is_cut_off_and_no_view_with_it(tmp_path: Path) -> None:
    """The bar ends with a line across the window; below it the first view begins, with a heading of its own."""
    path = tmp_path / "session.rrd"
    items = list(session.session_messages(camera=True, arm=True))
    write_rrd(items, path, topics={topic for topic, _, _ in items}, setup=setup_of(RigConfig(id="test")), name="test")
    with viewer.headless(size=(1200, 800)) as client:
        viewer.show(client, path, at_s=session.SLIP_S)
        whole = viewer.picture_of(client)
    cut = viewer.without_bar(whole)
    window, left = (np.asarray(Image.open(io.BytesIO(each)).convert("RGB")).astype(int) for each in (whole, cut))
    bar = window[: len(window) - len(left)]
    assert 0 < len(bar) < 50
    assert np.array_equal(window[len(bar) :], left)
    line, colour = bar[-1], np.median(bar[-1], axis=0)
    assert np.mean(np.all(line == colour, axis=1)) > 0.9, "a line across the window"
    assert np.mean(np.all(left[0] == colour, axis=1)) < 0.1


def test_without_a_renderer_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(viewer, "can_draw_headless", lambda: False)
    with pytest.raises(UserError, match="mesa-vulkan-drivers"):
        viewer.screenshot(tmp_path / "none.rrd", tmp_path / "out.png")


def test_a_view_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="cannot be written"):
        write_rrd([], tmp_path, topics=[], setup=Setup(), name="test")
