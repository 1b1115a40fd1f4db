"""The viewer itself, drawn without a display: no view complains, and the picture shows what it should."""

from __future__ import annotations

import io
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from shared.errors import UserError
from shared.rig import RigConfig
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
        picture = np.asarray(Image.open(io.BytesIO(viewer.picture_of(client))).convert("RGB")).astype(int)
    assert {name: view.reports for name, view in views.items() if view.reports} == {}
    assert {view.view_class for view in views.values()} >= {
        "3D",
        "TimeSeries",
        "StateTimeline",
        "TextLog",
        "TextDocument",
    }
    assert any(view.view_class == "2D" for view in views.values()) == camera
    if camera:
        assert _near(picture, colours.MARK).sum() > 50
        assert _near(picture, colours.REFERENCE).sum() > 50
    assert _near(picture, colours.PHASES["SLIP"]).sum() > 50


def _near(picture: np.ndarray, colour: colours.Colour) -> np.ndarray:
    return np.abs(picture - np.array(colour)).max(axis=-1) < 40


@needs_vulkan
def test_a_picture_is_written(tmp_path: Path) -> None:
    path, out = tmp_path / "session.rrd", tmp_path / "out.png"
    write_rrd(session.session_messages(), path, topics=["camera/corners"], setup=Setup(), name="test")
    assert viewer.screenshot(path, out) == []
    with Image.open(out) as picture:
        assert picture.size == (1600, 1000)


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
def test_plain_rerun_draws_the_corners_over_the_image_unaided(tmp_path: Path) -> None:
    recording = write_mcap(tmp_path / "session.mcap", session.session_messages())
    with viewer.headless(size=(1200, 800)) as client:
        client.open(str(recording))
        state = client.get_state()
        for _ in range(50):
            state = client.get_state()
            if any(view.view_class == "2D" for view in state.views) and not state.loading:
                break
        time.sleep(1.5)
        (image_view,) = [view for view in client.get_state().views if view.view_class == "2D"]
        picture = np.asarray(Image.open(io.BytesIO(viewer.picture_of(client, image_view.view_id))).convert("RGB"))
    assert image_view.reports == []
    assert _near(picture.astype(int), colours.MARK).sum() > 50


def test_without_a_renderer_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(viewer, "can_draw_headless", lambda: False)
    with pytest.raises(UserError, match="mesa-vulkan-drivers"):
        viewer.screenshot(tmp_path / "none.rrd", tmp_path / "out.png")


def test_a_view_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="cannot be written"):
        write_rrd([], tmp_path, topics=[], setup=Setup(), name="test")
