"""`python -m tests.faults.sabotaged CONTROL MODULE WORDS…`: one of our programs, with something broken when asked to.

The file CONTROL holds JSON, read ten times a second: `camera` (frozen, black, gone, covered), `arm` (deaf: set-points
do not reach the twin), `step_s` and `drift` of the process's clock. Only what the hardware or the system would do is
changed here; every line of the program runs as it does on a rig.
"""

from __future__ import annotations

import json
import runpy
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from shared.clock import SystemClock

_EVERY_S = 0.1
_GREY = 128
_PAPER = 1.5
"""The paper's reach from the mark's centre, in that of its corners: the white rim is covered too."""


class Control:
    """The values that the file asks for now."""

    def __init__(self, path: Path) -> None:
        self._path, self._due_s, self._values = path, 0.0, dict[str, Any]()

    def __getitem__(self, name: str) -> Any:
        if time.monotonic() >= self._due_s:
            self._due_s = time.monotonic() + _EVERY_S
            try:
                self._values = json.loads(self._path.read_text(encoding="utf-8"))
            except (OSError, ValueError):
                self._values = {}
        return self._values.get(name)


def sabotage(control: Control) -> None:
    """Puts the faults between the programs and their surroundings."""
    _clock(control)
    _camera(control)
    _mark(control)
    _arm(control)


def _clock(control: Control) -> None:
    honest = SystemClock.now_ns
    began_s = [0.0]

    def now_ns(self: SystemClock) -> int:
        drift = control["drift"] or 0.0
        if not drift:
            began_s[0] = time.monotonic()
        off_s = (control["step_s"] or 0.0) + drift * (time.monotonic() - began_s[0])
        return honest(self) + round(off_s * 1e9)

    SystemClock.now_ns = now_ns  # pyright: ignore[reportAttributeAccessIssue]


def _camera(control: Control) -> None:
    from pi_agent.cameras.synthetic import SyntheticCamera  # noqa: PLC0415

    honest, kept = SyntheticCamera.read, list[Any]()

    def read(self: SyntheticCamera, timeout_s: float) -> Any:
        frame, fault = honest(self, timeout_s), control["camera"]
        if frame is None:
            return None
        if fault != "frozen" or not kept:
            kept[:] = [frame.image.copy()]
        return replace(frame, image=_picture(str(fault or ""), frame.image, kept[0]))

    SyntheticCamera.read = read  # pyright: ignore[reportAttributeAccessIssue]


def _picture(fault: str, image: Any, kept: Any) -> Any:
    if fault == "frozen":
        return kept
    if fault == "black":
        return np.zeros_like(image)
    if fault == "gone":
        noise = np.random.default_rng().integers(-3, 4, image.shape)
        return (_GREY + noise).astype(np.uint8)
    return image


def _mark(control: Control) -> None:
    from pi_agent.synthetic_view import SyntheticView  # noqa: PLC0415

    honest = SyntheticView.frame_and_corners

    def frame_and_corners(self: SyntheticView, *scene: Any, **before: Any) -> tuple[Any, Any]:
        image, corners_px = honest(self, *scene, **before)
        return (half_covered(image, corners_px) if control["camera"] == "covered" else image), corners_px

    SyntheticView.frame_and_corners = frame_and_corners  # pyright: ignore[reportAttributeAccessIssue]


def half_covered(image: Any, corners_px: Any) -> Any:
    """The picture with paper over all of the mark's surroundings that is to the left of its centre: half of the mark.

    `corners_px` (4, 2) are the mark's; without any (0, 2) nothing is covered.
    """
    if not len(corners_px):
        return image
    x, y = corners_px.mean(axis=0)
    reach = np.linalg.norm(corners_px - (x, y), axis=1).max() * _PAPER
    top, bottom, left, right = (max(round(float(edge)), 0) for edge in (y - reach, y + reach, x - reach, x))
    covered = image.copy()
    covered[top:bottom, left:right] = _GREY
    return covered


def _arm(control: Control) -> None:
    from station.arm.drivers.simulated import BusWire  # noqa: PLC0415

    honest = BusWire.send

    def send(self: BusWire, now_ns: int, position_rad: Any, velocity_rad_s: Any) -> None:
        if control["arm"] != "deaf":
            honest(self, now_ns, position_rad, velocity_rad_s)

    BusWire.send = send  # pyright: ignore[reportAttributeAccessIssue]


if __name__ == "__main__":
    sabotage(Control(Path(sys.argv[1])))
    sys.argv = sys.argv[2:]
    runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
