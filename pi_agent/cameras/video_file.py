"""Plays a video or a folder of pictures as if a camera took them now.

`[camera.options]`: `path` (relative to the rig file), `rate_hz` (0: the video's own; pictures have none and take
`[camera] rate_hz`), `loop`.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import cv2
import numpy as np

from pi_agent.cameras import CameraContext, CameraInfo, Frame, Image
from pi_agent.tracking.tone import TONE_CURVES
from shared.config import parse
from shared.errors import UserError
from shared.pictures import too_large, unpacked_of_any_kind

Packed = Callable[[], Image]
"""A picture that is unpacked when it is called: those that a late reader misses are not.

They took a busy machine longer than they last, so that a reader missed more the longer it read: five pictures came in
200 s."""

BEHIND_S = 1.0
"""The lateness (s) beyond which a reader that does not catch up is told. A video's pictures follow from those before;
where they take longer than they play, each comes later than the one before, for ever. A pause is caught
up (`pytest tests/unit/pi_agent/test_video_file.py -k "longer or pause"`)."""

PICTURES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm")


@dataclass(frozen=True, kw_only=True)
class VideoOptions:
    """`[camera.options]`; `tone` is the curve of the camera that took the pictures."""

    path: str
    rate_hz: float = 0.0
    loop: bool = False
    tone: str = "linear"

    def __post_init__(self) -> None:
        """Refuses what cannot be played."""
        if not self.path or self.rate_hz < 0 or self.tone not in TONE_CURVES:
            raise ValueError(f"expected a path, no negative rate_hz, and for tone one of {', '.join(TONE_CURVES)}")


class VideoFileCamera:
    """Every picture is shown for one period of the rate; a reader that is late misses those that have passed."""

    def __init__(self, context: CameraContext) -> None:
        self._options = parse(VideoOptions, context.rig.camera.options)
        self._config, self._clock = context.rig.camera, context.clock
        self._path = context.folder / self._options.path
        self._pictures: Iterator[Packed] = iter(())
        self._next: Packed | None = None
        self._period_ns, self._start_ns = 1.0, 0
        self._seq, self._dropped = 0, 0
        self._ended = False

    def open(self) -> CameraInfo:
        """Opens the video or the folder of pictures at its first frame."""
        if self._ended:
            raise UserError(f"{self._path} has been played to its end: start the agent anew, or set loop = true")
        pictures, own_hz = open_pictures(self._path)
        packed = next(pictures, None)
        if packed is None:
            raise UserError(f"Expected a video or a folder of pictures at {self._path}, got one without any frame")
        first = packed()
        self._next, self._pictures = lambda: first, pictures
        rate_hz = self._options.rate_hz or own_hz or self._config.rate_hz
        self._period_ns, self._start_ns = 1e9 / rate_hz, self._clock.now_ns()
        self._seq, self._dropped = 0, 0
        return CameraInfo(
            name="video file",
            width_px=first.shape[1],
            height_px=first.shape[0],
            rate_hz=rate_hz,
            exposure_ns=round(1e6 * self._config.exposure_ms),
            gain=self._config.gain,
            tone=TONE_CURVES[self._options.tone],
            details=str(self._path),
            noiseless=self._options.loop,  # each picture comes again, noise and all
        )

    def read(self, timeout_s: float) -> Frame | None:
        """Waits until the next picture is due, skips those that have passed, and returns it.

        None if the next one is due later than `timeout_s`.
        """
        due_ns = self._start_ns + round(self._seq * self._period_ns)
        wait_s = (due_ns - self._clock.now_ns()) * 1e-9
        if wait_s > timeout_s:
            time.sleep(timeout_s)
            return None
        time.sleep(max(wait_s, 0.0))
        self._skip_passed()
        image, seq = self._take()(), self._seq
        self._seq += 1
        return Frame(image, self._start_ns + round(seq * self._period_ns), seq, self._dropped)

    def close(self) -> None:
        """Lets go of the pictures."""
        self._pictures, self._next = iter(()), None

    def _skip_passed(self) -> None:
        """Leaves out the pictures whose time is over.

        Raises:
            UserError: if that takes longer than they last.
        """
        behind = self._behind()
        for _ in range(behind):
            self._take()
            self._seq += 1
            self._dropped += 1
        if self._behind() >= behind > BEHIND_S * 1e9 / self._period_ns:
            hz = 1e9 / self._period_ns
            said = f"Expected pictures that this machine unpacks at {hz:.3g} Hz at {self._path}: lower rate_hz"
            raise UserError(said)

    def _behind(self) -> int:
        """Returns the number of pictures whose time is over."""
        return int((self._clock.now_ns() - self._start_ns) / self._period_ns) - self._seq

    def _take(self) -> Packed:
        """Returns the next picture; at the end the first one again, or the end.

        Raises:
            UserError: at the end.
        """
        picture = self._next if self._next is not None else next(self._pictures, None)
        self._next = None
        if picture is None and self._options.loop:
            self._pictures, _ = open_pictures(self._path)
            picture = next(self._pictures, None)
        if picture is None:
            self._ended = True
            raise UserError(f"{self._path} has been played to its end: start the agent anew, or set loop = true")
        return picture


def open_pictures(path: Path, *, setting: str = "path in [camera.options]") -> tuple[Iterator[Packed], float]:
    """Returns the grey pictures (height, width) uint8 of a video or a folder, and the video's own rate (0: none).

    One of a video is unpacked before the next is asked for, or not at all.

    `setting`: where the user has named it.

    Raises:
        UserError: if there is nothing, or nothing that can be read.
    """
    if path.is_dir():
        files = sorted(file for file in path.iterdir() if file.suffix.lower() in PICTURES)
        if not files:
            raise UserError(f"Expected pictures ({', '.join(PICTURES)}) in the folder {path}, got none")
        return (partial(_picture, file) for file in files), 0.0
    if not path.is_file():
        raise UserError(f"Expected a video or a folder of pictures at {path}, got nothing: set {setting}")
    quieten_decoders()
    video = cv2.VideoCapture(str(path))
    if not video.isOpened():
        raise UserError(f"Expected a video at {path}, got a file that OpenCV cannot read as one")
    rate_hz = float(video.get(cv2.CAP_PROP_FPS))
    return _frames(video), rate_hz if 0 < rate_hz < 10_000 else 0.0


def quieten_decoders() -> None:
    """Silences OpenCV and ffmpeg, which would write at every try: a sentence of ours says what is wrong with a file."""
    set_level = getattr(cv2, "setLogLevel", None) or cv2.utils.logging.setLogLevel  # OpenCV 4 has it at another place
    set_level(0)
    os.environ["OPENCV_FFMPEG_LOGLEVEL"] = "-8"


def _picture(file: Path) -> Image:
    try:
        data = file.read_bytes()
    except OSError as error:
        raise UserError(f"Expected a picture at {file}, but it cannot be read: {error.strerror}") from error
    if wrong := too_large(data):
        raise UserError(f"Expected a picture of a camera at {file}, got {wrong}; make it smaller")
    image = unpacked_of_any_kind(data)
    if image is None:
        raise UserError(f"Expected a picture at {file}, got a file that OpenCV cannot read as one")
    return np.asarray(image, dtype=np.uint8)


def _frames(video: cv2.VideoCapture) -> Iterator[Packed]:
    while video.grab():
        yield partial(_unpacked, video)
    video.release()


def _unpacked(video: cv2.VideoCapture) -> Image:
    ok, image = video.retrieve()
    if not ok:
        raise UserError("Expected a video whose pictures OpenCV can unpack, got one that it cannot")
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) if image.ndim == 3 else image, dtype=np.uint8)


def build(context: CameraContext) -> VideoFileCamera:
    """Builds the video camera of a rig."""
    return VideoFileCamera(context)
