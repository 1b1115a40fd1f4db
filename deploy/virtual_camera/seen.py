"""Runs inside the emulated machine: pi_camera through the real picamera2 on libcamera's virtual camera.

`python3 seen.py draw`, outside of it, writes the picture of a mark with known corners for the virtual camera to play.
`python3 seen.py SECONDS` opens our driver, reads its frames, tracks the mark, and prints one line of JSON after SEEN,
then RIGHT, or WRONG with what is.

What the virtual camera does not have and a Pi's camera has is added here, and nothing else is: its one mode in
`sensor_modes`, and exposure, gain and duration of a frame among the metadata. The library for a window on a screen
(`kms`), which picamera2 imports and Debian does not have, is an empty stand-in. Requests, jobs, buffers, mapped arrays,
time stamps, starting, stopping and closing are picamera2's and libcamera's own.
"""

import faulthandler
import importlib.metadata
import json
import os
import sys
import time
from importlib import import_module
from pathlib import Path
from typing import Any
from unittest.mock import MagicMock

import cv2
import numpy as np
from numpy.typing import NDArray

from pi_agent.cameras import CameraContext, load_camera
from pi_agent.rendering import Pose, Scene, render, surface
from pi_agent.tracking.config import TrackerConfig
from pi_agent.tracking.mark import Mark
from pi_agent.tracking.tracker import Tracker
from shared.clock import SystemClock
from shared.memory_bus import MemoryBus
from tests.unit.pi_agent.rigs import rig

MARK = Mark(side_mm=10.0, margin=0.16, feature="dot")
SIZE_PX, RATE_HZ, EXPOSURE_MS = 600, 30, 2.0
ENOUGH = 20  # frames; an emulated processor takes as long as six of them for one, and the driver counts the others
FRAMES, CORNERS = Path("/root/frames"), Path("/root/corners.npy")
PIPELINE = Path("/usr/share/libcamera/pipeline/virtual/virtual.yaml")
YAML = f""""Virtual0":
  supported_formats:
  - width: {SIZE_PX}
    height: {SIZE_PX}
    frame_rates:
    - {RATE_HZ}
  frames:
    path: "{FRAMES}"
  model: "drawn_mark"
"""


def draw() -> None:
    """Writes the picture that the virtual camera plays, the file that tells it so, and the true corners (4, 2)."""
    rng = np.random.default_rng(20261217)
    frame, corners = render(Scene(surface("wood", rng=rng), mark=MARK), Pose(3.0, -2.0, 0.4), rng=rng)
    FRAMES.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(FRAMES / "0.jpg"), frame, [cv2.IMWRITE_JPEG_QUALITY, 100])
    PIPELINE.parent.mkdir(parents=True, exist_ok=True)
    PIPELINE.write_text(YAML)
    np.save(CORNERS, corners)


def add_what_is_missing() -> None:
    """Gives picamera2's own classes what a Pi's pipeline tells and the virtual one does not."""
    sys.modules["kms"] = MagicMock()
    picamera2: Any = import_module("picamera2")
    whole: Any = picamera2.Picamera2
    completed: Any = import_module("picamera2.request").CompletedRequest

    class Virtual(whole):
        """With buffers of libcamera's own making: the virtual camera wants a plane each for light and colour."""

        def __init__(self, *arguments: Any, **named: Any) -> None:
            super().__init__(*arguments, **named)
            self.allocator = picamera2.allocators.LibcameraAllocator(self.camera)

        def _get_raw_modes(self) -> list[dict[str, Any]]:
            return [{"format": "R8", "size": (SIZE_PX, SIZE_PX)}]

        @property
        def sensor_modes(self) -> list[dict[str, Any]]:
            size = (SIZE_PX, SIZE_PX)
            return [{"format": "R8", "bit_depth": 8, "size": size, "fps": RATE_HZ, "crop_limits": (0, 0, *size)}]

    told = completed.get_metadata

    def get_metadata(request: Any) -> dict[str, Any]:
        added = {"ExposureTime": round(1e3 * EXPOSURE_MS), "AnalogueGain": 1.0, "FrameDuration": 1e6 / RATE_HZ}
        return {**added, **told(request)}

    completed.get_metadata = get_metadata
    picamera2.Picamera2 = Virtual


def look(seconds: float, truth: NDArray[np.float64]) -> dict[str, Any]:
    """Opens the driver twice, as an agent does whose cable was pulled, and tells what its frames were."""
    camera_keys: dict[str, Any] = {"width_px": SIZE_PX, "height_px": SIZE_PX, "rate_hz": RATE_HZ}
    setting = rig(driver="pi_camera", exposure_ms=EXPOSURE_MS, **camera_keys)
    clock = SystemClock()
    camera = load_camera(CameraContext(rig=setting, bus=MemoryBus(clock), clock=clock))
    camera.open()
    print("opened", flush=True)
    camera.close()
    info = camera.open()
    tracker = Tracker(TrackerConfig(mark=MARK))
    stamps, ages, numbers, errors, dropped = [], [], [], [], 0
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        frame = camera.read(1.0)
        if frame is None:
            continue
        ages.append((clock.now_ns() - frame.capture_ns) / 1e6)
        stamps.append(frame.capture_ns)
        numbers.append(frame.seq)
        dropped = frame.dropped
        seen = tracker.track(frame.image.copy(), capture_ns=frame.capture_ns)
        frame = None  # buffers of libcamera's own making are unmapped by the next read, which wants no views of them
        if seen.found:
            errors.append(float(np.sqrt(np.mean(np.sum((seen.corners_px - truth) ** 2, axis=1)))))
    camera.close()
    gaps_ms = np.diff(stamps) / 1e6
    return {
        "name": info.name,
        "rate_hz": info.rate_hz,
        "frames": len(stamps),
        "dropped": dropped,
        "numbered_in_order": bool(np.all(np.diff(numbers) >= 1)),
        "stamps_rise": bool(np.all(gaps_ms > 0)),
        "gap_ms_median": float(np.median(gaps_ms)),
        "age_ms_median": float(np.median(ages)),
        "age_ms_worst": float(np.max(ages)),
        "age_ms_least": float(np.min(ages)),
        "tracked": len(errors),
        "corner_rms_px": float(np.median(errors)) if errors else None,
    }


def faults(seen: dict[str, Any], seconds: float) -> list[str]:
    """Lists what is not as it must be; a busy computer may lose frames, but never their order or their times."""
    must = {
        f"{ENOUGH} frames or more came": seen["frames"] >= ENOUGH,
        "frames and dropped ones make up the time": seen["frames"] + seen["dropped"] >= 0.9 * RATE_HZ * seconds,
        "numbers and stamps rise": seen["numbered_in_order"] and seen["stamps_rise"],
        "no frame is older than 0.2 s in the median, or from the future": seen["age_ms_least"] >= 0
        and seen["age_ms_median"] < 200,
        "the mark is tracked in every frame": seen["tracked"] == seen["frames"],
        "its corners lie where they were drawn, within 0.05 px": (seen["corner_rms_px"] or 1.0) < 0.05,
    }
    return [what for what, holds in must.items() if not holds]


def main(seconds: float) -> None:
    """Looks through the driver for so many seconds, and prints what was seen and whether it is right.

    After four minutes without an end it says where every thread stands, and ends.
    """
    faulthandler.dump_traceback_later(seconds + 240.0, exit=True)
    os.environ.setdefault("LIBCAMERA_LOG_LEVELS", "*:WARN")
    add_what_is_missing()
    print("imported", flush=True)
    versions = {
        "picamera2": importlib.metadata.version("picamera2"),
        "libcamera": import_module("libcamera").CameraManager.singleton().version,
    }
    seen = look(seconds, np.load(CORNERS))
    print("SEEN", json.dumps({**versions, **seen}), flush=True)
    wrong = faults(seen, seconds)
    print("WRONG: not so: " + "; ".join(wrong) if wrong else "RIGHT", flush=True)


if __name__ == "__main__":
    draw() if sys.argv[1] == "draw" else main(float(sys.argv[1]))
