"""`station verify` reads the corners again from recorded pictures, and finds one that was moved."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from importlib.metadata import entry_points
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from pi_agent.lockstep import PixelCamera
from pi_agent.tracked_again import PictureTracker
from shared.clock import SimulatedClock
from shared.config import table_of
from shared.errors import UserError
from shared.foxglove import CompressedImage, Timestamp
from shared.memory_bus import MemoryBus
from shared.messages import MarkerCorners
from shared.pictures import size_px
from shared.rig import RigConfig, rig_of_table
from station.app import assembly
from station.app.corners_again import GROUP, CornersAgain, allowed_px, corners_again
from station.app.verifying import verify
from station.recording.provenance import Provenance
from station.recording.reader import open_recording
from station.recording.writer import Recording
from tests.unit.app.forging import Edit, Item, forged
from tests.unit.pi_agent.rigs import scene

FRAME_NS = 11_111_111
FRAMES = 120


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A block that rests and then slides, in pictures of 12 Hz."""
    rig, clock = assembly.rig_from(None), SimulatedClock()
    bus = MemoryBus(clock)
    path = tmp_path_factory.mktemp("pictures") / "session.mcap"
    with Recording(path, provenance=Provenance(rig_id=rig.id, started_ns=0, rig_toml=rig.text)) as recording:
        bus.subscribe("**", recording.write)
        camera = PixelCamera(bus, rig, seed=5)
        for number in range(FRAMES):
            now_ns = clock.now_ns() + FRAME_NS
            clock.advance_to(now_ns)
            slid_s = max(0.0, number / 90 - 0.5)
            x_m = -0.012 + min(slid_s * slid_s, 0.024)
            camera.tick(now_ns, scene(x_m, 0.002, 0.1 + 0.5 * slid_s, stamp_ns=now_ns))
    return path


def again(path: Path) -> CornersAgain:
    return corners_again(open_recording(path), PictureTracker(assembly.rig_from(None)))


def test_the_package_says_where_the_tracker_is() -> None:
    found = entry_points(group=GROUP, name="mark")
    if not found:
        pytest.skip("the installed package is older than its entry point: `make setup` installs it anew")
    assert next(iter(found)).load() is PictureTracker


def test_corners_are_those_of_the_pictures(recorded: Path) -> None:
    found = again(recorded)
    print(f"\n{found.compared} of {found.pictures} pictures, at most {found.worst_px:.3f} px apart")
    assert found.pictures == found.compared >= 14
    assert found.first is None
    assert found.worst_px < 0.06


def test_the_line_says_of_how_many_corners_a_picture_tells(recorded: Path) -> None:
    """A forger moved 44 of a slide's 52 corners, those without a picture: "corners identical" seemed to be of all."""
    found = again(recorded)
    (corners,) = (part for part in verify(recorded).parts if part.name == "corners")
    assert corners.state == "identical"
    assert found.corners == FRAMES
    assert f"{found.compared} of {FRAMES} read again, in {found.compared} of {found.pictures}" in corners.sentence
    assert f"of {FRAMES - found.compared} there is no picture" in corners.sentence


def moved(number: int, by_px: float, *, sigma_px: float = 0.01) -> Edit:
    def edit(items: Iterator[Item]) -> Iterable[Item]:
        stamps = list[int]()
        everything = list(items)
        for item in everything:
            if isinstance(item.message, CompressedImage):
                stamps.append(item.message.timestamp.ns)
        for item in everything:
            message = item.message
            if isinstance(message, MarkerCorners) and message.capture_ns == stamps[-3] and message.marker_id == 0:
                pixels = [*message.corners_px]
                pixels[number] += by_px
                changed = replace(message, corners_px=tuple(pixels), sigma_px=sigma_px)
                yield item.with_message(changed)
            else:
                yield item

    return edit


def test_fiducials_are_those_of_the_pictures(recorded: Path) -> None:
    found = corners_again(open_recording(recorded), PictureTracker(assembly.rig_from(None)), topic="camera/plate")
    print(f"\n{found.compared} fiducials in {found.pictures} pictures, at most {found.worst_px:.3f} px apart")
    assert found.compared > 4
    assert found.first is None


def test_fiducials_that_were_moved_are_named(recorded: Path, tmp_path: Path) -> None:
    """They tell the camera's sag from a block that moves: 5 px off, every part was identical."""

    def edit(items: Iterator[Item]) -> Iterable[Item]:
        for item in items:
            if isinstance(item.message, MarkerCorners) and item.topic == "camera/plate" and item.message.found:
                moved_px = tuple(one + 5.0 for one in item.message.corners_px)
                yield item.with_message(replace(item.message, corners_px=moved_px))
            else:
                yield item

    if not entry_points(group=GROUP, name="mark"):
        pytest.skip("the installed package is older than its entry point: `make setup` installs it anew")
    path = forged(recorded, tmp_path / "moved.mcap", edit)
    states = {part.name: part.state for part in verify(path).parts}
    assert (states["corners"], states["plate"]) == ("identical", "different")
    assert {part.name: part.state for part in verify(recorded).parts}["plate"] == "identical"


def test_what_does_not_follow_from_a_picture_is_said(recorded: Path) -> None:
    found = [part.sentence for part in verify(recorded).parts if part.name in ("corners", "plate")]
    assert all("sigma_px does not follow" in sentence for sentence in found)


@pytest.mark.parametrize(("number", "by_px", "sigma_px"), [(0, 0.2, 0.01), (5, -0.3, 0.01), (7, 1.0, 100.0)])
def test_a_corner_that_was_moved_is_named(
    recorded: Path, tmp_path: Path, number: int, by_px: float, sigma_px: float
) -> None:
    """A large standard deviation beside it makes it no truer."""
    path = forged(recorded, tmp_path / "moved.mcap", moved(number, by_px, sigma_px=sigma_px))
    found = again(path)
    assert found.different == 1
    assert found.first is not None
    assert found.first.number == number
    assert found.first.recorded_px - found.first.derived_px == pytest.approx(by_px, abs=0.06)


def test_the_command_names_it_too(recorded: Path, tmp_path: Path) -> None:
    if not entry_points(group=GROUP, name="mark"):
        pytest.skip("the installed package is older than its entry point: `make setup` installs it anew")
    path = forged(recorded, tmp_path / "moved.mcap", moved(2, 0.5))
    found = verify(path)
    assert not found.holds
    assert found.first is not None
    assert (found.first.topic, found.first.field) == ("camera/corners", "corners_px[2]")
    assert verify(recorded).holds


def test_a_picture_of_another_size_is_not_unpacked() -> None:
    """A header that promises 65 500 x 65 500 pixels would take 4 GB."""
    bomb = b"\xff\xd8\xff\xc0\x00\x0b\x08\xff\xdc\xff\xdc\x01\x01\x11\x00"
    assert size_px(bomb) == (65500, 65500)
    assert PictureTracker(assembly.rig_from(None)).corners(bomb, like=MarkerCorners(capture_ns=1)) is None
    assert allowed_px(MarkerCorners()) > 0


SEEN = """
[camera]
px_per_mm = {px_per_mm}
[mark]
side_mm = {side_mm}
aspect = {aspect}
[block]
size_m = [0.01, 0.01, {block_m}]
"""
USUAL: dict[str, float] = {"px_per_mm": 6.0, "side_mm": 7.5, "aspect": 1.0, "block_m": 0.01}


def stranger(**changed: float) -> RigConfig:
    return rig_of_table(table_of('id = "one"' + SEEN.format(**(USUAL | changed)), "rig.toml"))


def first_picture(path: Path) -> tuple[bytes, MarkerCorners]:
    items = [item.message for item in open_recording(path).messages({"camera/corners", "camera/image"})]
    picture = next(one for one in items if isinstance(one, CompressedImage))
    stamp_ns = picture.timestamp.ns
    return picture.data, next(one for one in items if isinstance(one, MarkerCorners) and one.capture_ns == stamp_ns)


@pytest.mark.parametrize(
    "changed", [{"px_per_mm": 1e6}, {"side_mm": 1e9}, {"aspect": 1e9}, {"aspect": 1e-9}, {"block_m": 0.2999999}]
)
def test_a_strangers_mark_that_is_larger_than_the_picture_is_not_found(
    recorded: Path, changed: dict[str, float]
) -> None:
    picture, like = first_picture(recorded)
    found = PictureTracker(stranger(**changed)).corners(picture, like=like)
    assert found is not None
    assert not found.found


@pytest.mark.parametrize(
    ("changed", "said"), [({"block_m": 0.3}, "lower than its camera"), ({"px_per_mm": 1e9}, "view")]
)
def test_a_strangers_rig_that_no_camera_sees_is_refused(changed: dict[str, float], said: str) -> None:
    with pytest.raises(UserError, match=said):
        PictureTracker(stranger(**changed))


def calibration(**changed: str) -> str:
    values = {
        "focal_px": "[1800.0, 1800.0]",
        "centre_px": "[299.5, 299.5]",
        "plate_from_pixel": "[1.7e-4, 0.0, -0.05, 0.0, -1.7e-4, 0.05, 0.0, 0.0, 1.0]",
        "camera_m": "[0.0, 0.0, 0.3]",
    }
    lines = [f"{name} = {value}" for name, value in (values | changed).items()]
    return "\n".join(['source = "a stranger"', "width_px = 600", "height_px = 600", *lines])


@pytest.mark.parametrize(
    "changed",
    [
        {"centre_px": "[nan, 299.5]"},
        {"camera_m": "[0.0, 0.0, nan]"},
        {"plate_from_pixel": "[1.7e-4, 0.0, -0.05, 0.0, -1.7e-4, 0.05, 0.0, 0.0, 1e300]"},
        {"plate_from_pixel": "[1.7e-4, 0.0, -0.05, 0.0, -1.7e-4, 0.05, 1e9, 0.0, 1.0]"},
        {"tone_light": "[0.0, 1e300, 1.0]", "tone_value": "[0.0, 0.5, 1.0]"},
    ],
)
def test_a_strangers_calibration_that_is_none_is_refused(changed: dict[str, str]) -> None:
    PictureTracker(stranger(), calibration())
    with pytest.raises(UserError, match=r"calibration\.toml"):
        PictureTracker(stranger(), calibration(**changed))


class Misled:
    """A tracker that pictures before have misled by so many pixels; by itself it reads what was recorded."""

    def __init__(self, by_px: float) -> None:
        self.by_px = by_px

    def corners(self, picture: bytes, *, like: MarkerCorners) -> MarkerCorners:
        del picture
        return replace(like, corners_px=tuple(one + self.by_px for one in TRUE_PX), sigma_px=0.01)

    def alone(self, picture: bytes, *, like: MarkerCorners) -> MarkerCorners:
        del picture
        return replace(like, corners_px=TRUE_PX, sigma_px=0.01)


TRUE_PX = (10.0, 10.0, 20.0, 10.0, 20.0, 20.0, 10.0, 20.0)


def of_one_picture(recorded_px: tuple[float, ...], by_px: float) -> CornersAgain:
    messages = [
        MarkerCorners(capture_ns=5, found=True, corners_px=recorded_px),
        CompressedImage(timestamp=Timestamp.from_ns(5), data=b""),
    ]

    def read(topics: set[str]) -> list[Any]:
        assert {"camera/corners", "camera/image"} <= topics
        return [SimpleNamespace(message=one) for one in messages]

    reader: Any = SimpleNamespace(messages=read)
    return corners_again(reader, Misled(by_px))


def test_a_picture_counts_as_different_only_if_it_is_so_by_itself_too() -> None:
    """Earlier packed pictures teach a tracker a wrong shape: it moved a corner of a slide by .14 px, once in 647."""
    assert of_one_picture(TRUE_PX, 0.14).different == 0
    assert of_one_picture(TRUE_PX, 0.14).worst_px == 0.0
    moved = (10.2, *TRUE_PX[1:])
    assert of_one_picture(moved, 0.0).different == 1
    assert of_one_picture(moved, 0.14).different == 1


def test_pictures_of_moments_without_corners_are_no_proof(recorded: Path, tmp_path: Path) -> None:
    """Pictures of another session, or whose stamps were changed, show nothing of this one."""

    def later(items: Iterator[Item]) -> Iterable[Item]:
        for item in items:
            message = item.message
            if isinstance(message, CompressedImage):
                yield item.with_message(replace(message, timestamp=Timestamp.from_ns(message.timestamp.ns + 1)))
            else:
                yield item

    path = forged(recorded, tmp_path / "later.mcap", later)
    assert again(path).stampless >= 14
    if entry_points(group=GROUP, name="mark"):
        assert not verify(path).holds
