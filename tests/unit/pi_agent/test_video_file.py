"""Videos and folders of pictures as a camera, by a clock that only the test moves: no load makes a frame late."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest

from pi_agent.cameras import Camera, CameraContext, Frame, Image, load_camera, video_file
from pi_agent.observer import Observer
from pi_agent.synthetic_view import SyntheticView
from shared.clock import SystemClock
from shared.errors import UserError
from shared.memory_bus import MemoryBus
from tests.patience import PATIENCE_S
from tests.unit.pi_agent.rigs import rig, scene

Opener = Callable[..., Camera]


class HandClock(SystemClock):
    """Stands still but for those who sleep."""

    def __init__(self) -> None:
        super().__init__()
        self._now_ns = super().now_ns()

    def now_ns(self) -> int:
        return self._now_ns

    def sleep(self, seconds: float) -> None:
        self._now_ns += round(seconds * 1e9)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> HandClock:
    clock = HandClock()
    monkeypatch.setattr(video_file, "time", SimpleNamespace(sleep=clock.sleep))
    return clock


@pytest.fixture
def camera(clock: HandClock) -> Opener:
    def opened(folder: Path, **options: Any) -> Camera:
        config = rig(driver="video_file", options=options)
        return load_camera(CameraContext(rig=config, bus=MemoryBus(clock), clock=clock, folder=folder))

    return opened


def read(source: Camera) -> Frame:
    frame = source.read(2.0)
    assert frame is not None
    return frame


def pictures(folder: Path, count: int, *, size: int = 32) -> None:
    for number in range(count):
        cv2.imwrite(str(folder / f"{number:04d}.png"), np.full((size, size), 10 * number, dtype=np.uint8))


def test_a_folder_is_played_in_order_at_the_given_rate(camera: Opener, tmp_path: Path):
    pictures(tmp_path, 5)
    source = camera(tmp_path, path=".", rate_hz=20.0)
    info = source.open()
    frames = [read(source) for _ in range(4)]
    assert info.rate_hz == 20.0
    assert [frame.image[0, 0] // 10 for frame in frames] == [frame.seq for frame in frames] == [0, 1, 2, 3]
    assert np.all(np.diff([frame.capture_ns for frame in frames]) == 50_000_000)


def test_who_comes_late_gets_the_newest_and_is_told_how_many_were_lost(
    camera: Opener, clock: HandClock, tmp_path: Path
):
    pictures(tmp_path, 9)
    source = camera(tmp_path, path=".", rate_hz=20.0)
    source.open()
    read(source)
    clock.sleep(0.22)
    late = read(source)
    assert (late.seq, late.dropped, late.image[0, 0]) == (4, 3, 40)
    assert clock.now_ns() - late.capture_ns < 50_000_000


def test_pictures_that_were_missed_cost_nothing(
    camera: Opener, clock: HandClock, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """Each takes a machine three periods to unpack: it gets every third or fourth, and not ever fewer of them."""
    pictures(tmp_path, 20)
    unpacked = video_file.unpacked_of_any_kind

    def slowly(data: bytes) -> Image | None:
        clock.sleep(0.15)
        return unpacked(data)

    monkeypatch.setattr(video_file, "unpacked_of_any_kind", slowly)
    source = camera(tmp_path, path=".", rate_hz=20.0, loop=True)
    source.open()
    frames = [read(source) for _ in range(30)]
    assert set(np.diff([frame.seq for frame in frames[1:]])) <= {3, 4}
    assert all(frame.image[0, 0] == 10 * (frame.seq % 20) for frame in frames)


def test_a_video_that_takes_longer_than_it_plays_is_told(
    camera: Opener, clock: HandClock, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    def slow(video: cv2.VideoCapture) -> Iterator[Callable[[], Image]]:
        del video
        while True:
            clock.sleep(0.06)
            yield lambda: np.zeros((8, 8), dtype=np.uint8)

    monkeypatch.setattr(video_file, "_frames", slow)
    writer = cv2.VideoWriter(str(tmp_path / "v.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 20.0, (64, 64))
    writer.write(np.zeros((64, 64, 3), dtype=np.uint8))
    writer.release()
    source = camera(tmp_path, path="v.avi")
    source.open()
    with pytest.raises(UserError, match=r"unpacks at 20 Hz at .*v\.avi: lower rate_hz"):
        [read(source) for _ in range(1000)]


def test_a_pause_of_the_machine_is_caught_up(camera: Opener, clock: HandClock, tmp_path: Path):
    pictures(tmp_path, 3)
    source = camera(tmp_path, path=".", rate_hz=20.0, loop=True)
    source.open()
    clock.sleep(40.0)
    assert read(source).seq == 800


def test_the_end_is_said_and_stays_said(camera: Opener, tmp_path: Path):
    pictures(tmp_path, 2)
    source = camera(tmp_path, path=".", rate_hz=20.0)
    source.open()
    for _ in range(2):
        read(source)
    with pytest.raises(UserError, match="played to its end"):
        source.read(1.0)
    source.close()
    with pytest.raises(UserError, match="played to its end"):
        source.open()


def test_a_loop_goes_on(camera: Opener, tmp_path: Path):
    pictures(tmp_path, 3)
    source = camera(tmp_path, path=".", rate_hz=200.0, loop=True)
    source.open()
    frames = [read(source) for _ in range(10)]
    assert all(frame.image[0, 0] == 10 * (frame.seq % 3) for frame in frames)


def test_a_video_is_tracked_as_a_camera_is(camera: Opener, tmp_path: Path):
    view = SyntheticView(rig(), rng=np.random.default_rng(1))
    writer = cv2.VideoWriter(str(tmp_path / "v.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 30.0, (600, 600))
    for number in range(6):
        image = view.frame(scene(0.001 * number), 0)
        writer.write(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR))
    writer.release()
    source = camera(tmp_path, path="v.avi")
    info = source.open()
    assert info.rate_hz == pytest.approx(30.0)
    observer = Observer(rig(), info)
    reports = [observer.block(read(source)) for _ in range(2)]
    assert all(report.found for report in reports)
    last = SyntheticView(rig(), rng=np.random.default_rng(1)).frame_and_corners(scene(0.001 * reports[-1].seq), 0)[1]
    np.testing.assert_allclose(np.reshape(reports[-1].corners_px, (4, 2)), last, atol=0.3)


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("v.mp4", b"this is no video", "cannot read"),
        ("a/p.png", b"no picture", "cannot read"),
        ("b/x.txt", b"", "none"),
    ],
)
def test_garbage_is_named_in_one_sentence(camera: Opener, tmp_path: Path, name: str, content: bytes, said: str):
    file = tmp_path / name
    file.parent.mkdir(exist_ok=True)
    file.write_bytes(content)
    source = camera(tmp_path, path=name if "." in name.split("/", maxsplit=1)[0] else name.split("/", maxsplit=1)[0])
    with pytest.raises(UserError, match=said):
        source.open()


def test_a_missing_file_is_named(camera: Opener, tmp_path: Path):
    with pytest.raises(UserError, match=r"nowhere\.mp4"):
        camera(tmp_path, path="nowhere.mp4").open()


def test_the_path_has_no_default(camera: Opener, tmp_path: Path):
    with pytest.raises(UserError, match="path"):
        camera(tmp_path)


def test_an_unknown_option_is_named(camera: Opener, tmp_path: Path):
    with pytest.raises(UserError, match="speed"):
        camera(tmp_path, path=".", speed=2)


def test_the_decoders_add_nothing_to_our_sentence(tmp_path: Path):
    """The decoders run in a process of their own: ffmpeg asks only once how much it may say."""
    (tmp_path / "garbage.mp4").write_bytes(np.random.default_rng(1).bytes(50_000))
    words = (
        "from pathlib import Path; from pi_agent.cameras.video_file import open_pictures\n"
        "from shared.errors import UserError\n"
        f"try: open_pictures(Path({str(tmp_path / 'garbage.mp4')!r}))\n"
        "except UserError as error: print(error)"
    )
    done = subprocess.run([sys.executable, "-c", words], capture_output=True, text=True, timeout=PATIENCE_S, check=True)
    assert "cannot read as one" in done.stdout
    assert done.stderr == ""
