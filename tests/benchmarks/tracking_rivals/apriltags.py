"""pupil-apriltags in a process of its own: it now and then corrupts the heap of the one that it runs in.

`python -m tests.benchmarks.tracking_rivals.apriltags FRAMES.npy ANSWERS.npz FAMILY ID` reads frames (n, h, w) and
writes corners (n, 4, 2), NaN where there is none, and milliseconds (n,).
"""

import subprocess
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def installed() -> bool:
    """True if pupil-apriltags can be run here."""
    return find_spec("pupil_apriltags") is not None


def detect_all(frames: list[NDArray[np.uint8]], folder: Path, *, family: str, tag_id: int) -> tuple[Floats, Floats]:
    """Corners (n, 4, 2) and milliseconds (n,) of the frames, through files in `folder`."""
    asked, answer = folder / "frames.npy", folder / "answers.npz"
    np.save(asked, np.stack(frames))
    command = [sys.executable, "-m", __name__, str(asked), str(answer), family, str(tag_id)]
    subprocess.run(command, check=False, timeout=250)  # its exit status is the heap's, the answers are written by then
    with np.load(answer) as held:
        return held["corners"], held["milliseconds"]


def main(asked: str, answer: str, family: str, tag_id: str) -> None:
    """The child's work. Corners are brought to the pixel convention used here, half a pixel less."""
    detector: Any = import_module("pupil_apriltags").Detector(families=family, nthreads=1, quad_decimate=1.0)
    frames = np.load(asked)
    corners, milliseconds = np.full((len(frames), 4, 2), np.nan), np.zeros(len(frames))
    for number, frame in enumerate(frames):
        start = perf_counter()
        tags = detector.detect(frame)
        milliseconds[number] = 1e3 * (perf_counter() - start)
        for tag in tags:
            if tag.tag_id == int(tag_id):
                corners[number] = np.asarray(tag.corners) - 0.5
    np.savez(answer, corners=corners, milliseconds=milliseconds)


if __name__ == "__main__":
    main(*sys.argv[1:5])
