"""Tracks the mark in pictures and videos, and prints what is seen, one line a frame."""

import argparse
import json
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from pi_agent.cameras.video_file import quieten_decoders
from pi_agent.diagnosis import light_fault
from pi_agent.tracking.config import TrackerConfig
from pi_agent.tracking.mark import Feature, Mark
from pi_agent.tracking.observation import Observation
from pi_agent.tracking.shutter import Shutter
from pi_agent.tracking.tone import TONE_CURVES
from pi_agent.tracking.tracker import Tracker
from shared.errors import UserError
from shared.messages import MarkerCorners
from shared.pictures import too_large, unpacked_of_any_kind

Frame = NDArray[np.uint8]

EXAMPLE = "pi-agent track PICTURE.png --json"
ONE = "in some frame the mark was not found"
PICTURES = {".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm", ".webp"}
FEATURES: tuple[Feature, ...] = ("none", "dot", "notch", "tag")
DEFAULT_RATE_HZ = 90.0
SMALLEST_FRAME_PX = 32
MISCOUNTED = 0.02  # share of a video's frames by which its own count, often an estimate, may be too high


@dataclass(frozen=True)
class Shot:
    """One frame of a file: its number and capture time within the file."""

    path: Path
    number: int
    capture_ns: int
    frame: Frame


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options of `pi-agent track`."""
    parser.add_argument(
        "paths", nargs="+", type=Path, metavar="PATH", help="pictures (each for itself), folders of them, or videos"
    )
    parser.add_argument(
        "--json", action="store_true", help="one JSON line a frame: path and the fields of MarkerCorners"
    )
    parser.add_argument("--feature", choices=FEATURES, default="none", help="what tells the mark's corners apart")
    parser.add_argument("--aspect", type=float, default=1.0, help="second side of the mark over the first")
    parser.add_argument("--margin", type=float, default=0.0, help="white margin in sides of the mark (0: bare tape)")
    parser.add_argument("--tag", default="APRILTAG_16h5:0", metavar="DICTIONARY:ID", help="the code inside a tag mark")
    parser.add_argument("--tone", choices=sorted(TONE_CURVES), default="linear", help="the camera's tone curve")
    parser.add_argument(
        "--side-px",
        type=float,
        nargs=2,
        default=(36.0, 150.0),
        metavar=("MIN", "MAX"),
        help="shortest and longest first side of the mark in the picture",
    )
    parser.add_argument("--line-us", type=float, default=0.0, help="rolling shutter: microseconds from row to row")
    parser.add_argument("--exposure-ms", type=float, default=0.0, help="exposure, which blurs a mark that moves")
    parser.add_argument("--rate", type=float, default=None, help="frames a second of a video that does not say it")


def run(args: argparse.Namespace) -> int:
    """Tracks every frame of every path; 0 when the mark was found in all, 1 when not.

    A path that cannot be read, or a video that breaks off, is named on stderr and the others are still tracked; then
    the result is 2. A single such path, or settings that make no sense, raise UserError.
    """
    config = tracker_config(args)
    quieten_decoders()
    paths = [path for given in args.paths for path in _pictures_in(given)]
    lost, unread = 0, 0
    for path in paths:
        try:
            lost += _track_and_print(path, config, args)
        except UserError as error:
            if len(paths) == 1:
                raise
            unread += 1
            print(f"pi-agent: {error}", file=sys.stderr)
    return 2 if unread else int(lost > 0)


def _track_and_print(path: Path, config: TrackerConfig, args: argparse.Namespace) -> int:
    """Prints a line a frame; returns how many frames were without the mark."""
    lost, changed = 0, 0
    for shot, seen in track_file(path, config=config, rate_hz=args.rate):
        lost += not seen.found
        changed += seen.reason.startswith("outline changed")
        line = json_line(shot, seen, exposure_ns=config.shutter.exposure_ns) if args.json else text_line(shot, seen)
        print(line, flush=True)
    if changed and config.shutter.line_ns == 0:
        print(
            f"pi-agent: {path}: the outline changed in {changed} frames; if the camera has a rolling shutter, which "
            "makes a mark that moves another shape, say its time from row to row with --line-us",
            file=sys.stderr,
        )
    return lost


def _pictures_in(path: Path) -> list[Path]:
    """Returns the path itself, or the pictures in a folder by name; raises UserError when it holds none."""
    if not path.is_dir():
        return [path]
    pictures = sorted(entry for entry in path.iterdir() if entry.suffix.lower() in PICTURES)
    if not pictures:
        raise UserError(
            f"{path} is a folder without pictures ({', '.join(sorted(PICTURES))}); name a picture or a video"
        )
    return pictures


def tracker_config(args: argparse.Namespace) -> TrackerConfig:
    """Returns the tracker's settings from the options; raises UserError for ones that make no sense."""
    dictionary, _, number = str(args.tag).partition(":")
    if not number.isdigit() or not hasattr(cv2.aruco, f"DICT_{dictionary}"):
        raise UserError(f"--tag: expected an OpenCV dictionary and a number such as APRILTAG_16h5:0, got {args.tag!r}")
    if not 0 < args.side_px[0] < args.side_px[1]:
        raise UserError(f"--side-px: expected a smaller and a larger length above 0, got {args.side_px}")
    if args.aspect <= 0 or args.margin < 0:
        raise UserError("--aspect must be above 0 and --margin not below 0")
    mark = Mark(
        aspect=args.aspect, margin=args.margin, feature=args.feature, tag_dictionary=dictionary, tag_id=int(number)
    )
    if not (0.0 <= args.line_us < np.inf and 0.0 <= args.exposure_ms < np.inf):
        raise UserError(
            f"--line-us and --exposure-ms: expected numbers from 0 on, got {args.line_us} and {args.exposure_ms}"
        )
    shutter = Shutter(line_ns=1e3 * args.line_us, exposure_ns=round(1e6 * args.exposure_ms))
    return TrackerConfig(
        mark=mark, side_px=(args.side_px[0], args.side_px[1]), tone=TONE_CURVES[args.tone], shutter=shutter
    )


def track_file(
    path: Path, *, config: TrackerConfig, rate_hz: float | None = None
) -> Iterator[tuple[Shot, Observation]]:
    """Yields the observation in each frame of a picture or a video.

    Raises:
        UserError: when it is neither, or after the last frame that can be decoded when there should be more.
    """
    tracker = Tracker(config)
    for shot in _shots(path, rate_hz):
        seen = tracker.track(shot.frame, capture_ns=shot.capture_ns)
        dark_or_bright = "" if seen.found else light_fault(shot.frame)
        yield shot, replace(seen, reason=dark_or_bright) if dark_or_bright else seen


def _shots(path: Path, rate_hz: float | None) -> Iterator[Shot]:
    if not path.exists():
        raise UserError(f"{path}: no such file; give pictures or videos")
    if path.suffix.lower() in PICTURES:
        yield Shot(path, 0, 0, _picture(path))
        return
    yield from _video(path, rate_hz)


def _picture(path: Path) -> Frame:
    try:
        data = path.read_bytes()
    except OSError as error:
        raise UserError(f"{path}: expected a picture, but it cannot be read: {error.strerror}") from error
    if wrong := too_large(data):
        raise UserError(f"{path}: expected a picture of a camera, but it is {wrong}; make it smaller")
    picture = unpacked_of_any_kind(data)
    if picture is None:
        raise UserError(f"{path}: expected a picture, but it cannot be decoded; it is empty, cut off or something else")
    return _large_enough(path, np.asarray(picture, dtype=np.uint8))


def _video(path: Path, rate_hz: float | None) -> Iterator[Shot]:
    video = cv2.VideoCapture(str(path))
    rate = rate_hz or video.get(cv2.CAP_PROP_FPS) or DEFAULT_RATE_HZ
    promised = video.get(cv2.CAP_PROP_FRAME_COUNT)
    number = 0
    try:
        while True:
            more, picture = video.read()
            if not more:
                break
            grey = picture if picture.ndim == 2 else cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
            frame = _large_enough(path, np.asarray(grey, dtype=np.uint8))
            yield Shot(path, number, round(number * 1e9 / rate), frame)
            number += 1
    finally:
        video.release()
    if number == 0:
        raise UserError(f"{path}: expected a picture or a video, but not one frame of it can be decoded")
    if number + 1 < (1.0 - MISCOUNTED) * promised:
        raise UserError(
            f"{path}: {number} frames can be decoded where the file says that it holds {promised:.0f}; it is cut off "
            "or damaged there"
        )


def _large_enough(path: Path, frame: Frame) -> Frame:
    height, width = frame.shape
    if min(height, width) < SMALLEST_FRAME_PX:
        raise UserError(f"{path}: {width} x {height} pixels are too few to hold a mark")
    return frame


def marker_corners(seen: Observation, *, seq: int = 0, exposure_ns: int = 0, marker_id: int = 0) -> MarkerCorners:
    """Returns the message of an observation."""
    known = bool(np.isfinite(seen.corners_px).all())
    return MarkerCorners(
        capture_ns=seen.capture_ns,
        seq=seq,
        corners_px=tuple(seen.corners_px.ravel().tolist()) if known else (),
        sigma_px=seen.sigma_px if known else 0.0,
        residual_px=seen.residual_px if known else 0.0,
        exposure_ns=exposure_ns,
        corner_dt_ns=seen.corner_dt_ns if known else (),
        found=seen.found,
        reason=seen.reason,
        marker_id=marker_id,
        tipped=seen.tip_rad > 0,
    )


def json_line(shot: Shot, seen: Observation, *, exposure_ns: int) -> str:
    """Returns the path and the fields of MarkerCorners."""
    corners = marker_corners(seen, seq=shot.number, exposure_ns=exposure_ns)
    return json.dumps({"path": str(shot.path), **asdict(corners)})


def text_line(shot: Shot, seen: Observation) -> str:
    """Returns the same for people."""
    place = f"{shot.path} [{shot.number}]"
    if not seen.found:
        return f"{place}: not found: {seen.reason}"
    corners = "  ".join(f"({x:.3f}, {y:.3f})" for x, y in seen.corners_px.tolist())
    note = f"  {seen.reason}" if seen.reason else ""
    return f"{place}: {corners}  sigma {seen.sigma_px:.3f} px  residual {seen.residual_px:.3f} px{note}"
