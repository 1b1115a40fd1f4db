"""A small recorded session for the tests: the frequent topics, two runs, one of them censored, and a truth."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from shared.clock import SIMULATION_EPOCH_NS
from shared.geometry import mark_corners, pixels_of_mark, plate_from_pixel
from shared.messages import (
    AgentStatus,
    CameraGeometry,
    ClockOffset,
    JointState,
    MarkerCorners,
    Message,
    MotionReport,
    PlatformState,
    RunEvent,
    Sample,
    TiltCommand,
    TwinScene,
)
from station.recording.provenance import Attachment, Provenance
from station.recording.writer import Recording

START_NS = SIMULATION_EPOCH_NS
RUN_S = 2.0
ONSET_S = 1.5
RATE_RAD_S = 0.2
LATENCY_NS = 4_000_000
GEOMETRY = CameraGeometry(
    stamp_ns=START_NS,
    plate_from_pixel=tuple(plate_from_pixel(px_per_m=6000.0, centre_px=(299.5, 299.5)).ravel().tolist()),
    mm_per_px=1 / 6.0,
    marker_side_m=0.01,
    mark_height_m=0.01,
    camera_height_m=0.3,
    corner_sigma_px=0.02,
)


def provenance(**changes: object) -> Provenance:
    values: dict[str, object] = {
        "rig_id": "bench",
        "started_ns": START_NS,
        "mode": "lockstep",
        "seed": 7,
        "rig_toml": 'id = "bench"\n',
        "plan_toml": "samples = 2\n",
        "attachments": (Attachment(name="note.txt", data=b"by hand"),),
    }
    return Provenance(**(values | changes))  # pyright: ignore[reportArgumentType]  # names and values of the class


def block_place_m(run: int, t_s: float) -> tuple[float, float]:
    """Returns the block's place in the plate, `t_s` into a run: at rest, then sliding along +x in the first run."""
    slid = 0.5 * 1.0 * max(0.0, t_s - ONSET_S) ** 2 if run == 1 else 0.0
    return 0.001 + slid, -0.002


def traffic(*, truth: bool = True) -> Iterator[tuple[int, str, Message]]:
    """Receive time, topic and message of two runs, in order of receipt."""
    items = [item for run in (1, 2) for item in _run(run)]
    items += [(START_NS, "camera/geometry", GEOMETRY)]
    for second in range(4):
        now_ns = START_NS + second * 1_000_000_000
        items.append((now_ns, "camera/status", AgentStatus(stamp_ns=now_ns, frames=90 * second, boot_id=9)))
        items.append((now_ns, "clock", ClockOffset(stamp_ns=now_ns, agent="camera", sigma_ns=20_000, rtt_ns=90_000)))
    chosen = (item for item in items if truth or not item[1].startswith("truth/"))
    return iter(sorted(chosen, key=lambda item: item[0]))


def _run(run: int) -> list[tuple[int, str, Message]]:
    start_ns = START_NS + int((run - 1) * RUN_S * 1e9)
    at = [start_ns + int(s * 1e9) for s in (0.0, 0.5, ONSET_S, RUN_S - 0.01)]
    slips = run == 1
    items: list[tuple[int, str, Message]] = [
        (at[0], "session/event", RunEvent(stamp_ns=at[0], run=run, phase="REFERENCE")),
        (at[1], "session/event", RunEvent(stamp_ns=at[1], run=run, phase="TILT")),
        (at[1], "arm/command", TiltCommand(stamp_ns=at[1], run=run, direction=run, angle_rad=0.3, step=1)),
        (at[1], "arm/motion", MotionReport(stamp_ns=at[1], run=run, step=1, begin_ns=at[1])),
        (at[3], "session/event", RunEvent(stamp_ns=at[3], run=run, phase="DONE" if slips else "ABORTED")),
        (at[3], "session/sample", _sample(run, at)),
    ]
    if slips:
        items.append((at[2], "session/event", RunEvent(stamp_ns=at[2], run=run, phase="SLIP")))
    items += [_frame(run, start_ns, frame) for frame in range(int(RUN_S * 90))]
    for step in range(int(RUN_S * 100)):
        stamp_ns = start_ns + step * 10_000_000
        tilt = RATE_RAD_S * max(0.0, step / 100 - 0.5)
        state = PlatformState(stamp_ns=stamp_ns, qw=math.cos(tilt / 2), qy=math.sin(tilt / 2), wy=RATE_RAD_S)
        items.append((stamp_ns, "arm/platform", state))
        items.append((stamp_ns, "arm/joints", JointState(stamp_ns=stamp_ns, name=("j1",), position_rad=(tilt,))))
        items.append((stamp_ns, "truth/scene", TwinScene(stamp_ns=stamp_ns, mu=0.35)))
    return items


def _frame(run: int, start_ns: int, frame: int) -> tuple[int, str, Message]:
    capture_ns = start_ns + frame * 1_000_000_000 // 90
    place = np.array(block_place_m(run, frame / 90))
    pixels = pixels_of_mark(mark_corners(side_m=0.01) + place, GEOMETRY)
    pixels[0, 0] += 1e-9 * (frame % 2)  # no camera sees the same twice
    seq = (run - 1) * int(RUN_S * 90) + frame
    corners = MarkerCorners(
        capture_ns=capture_ns,
        seq=seq,
        corners_px=tuple(pixels.ravel().tolist()),
        sigma_px=0.02,
        corner_dt_ns=(0, 0, 1000, 1000),
        found=True,
        boot_id=9,
    )
    return capture_ns + LATENCY_NS, "camera/corners", corners


def _sample(run: int, at: list[int]) -> Sample:
    slips = run == 1
    return Sample(
        run=run,
        start_ns=at[0],
        slip_ns=at[2] if slips else 0,
        detect_ns=at[2] + 30_000_000 if slips else 0,
        euler_rad=(0.0, 0.2, 0.0),
        reference_corners_px=tuple(pixels_of_mark(mark_corners(side_m=0.01), GEOMETRY).ravel().tolist()),
        direction=run,
        onset_angle_rad=0.2 if slips else 0.3,
        onset_sigma_rad=0.001,
        flags=() if slips else ("no slip", "short, dwell"),
        object="block",
        plate="steel",
        censored=not slips,
    )


def record(path: Path, *, truth: bool = True, overwrite: bool = False) -> Path:
    """Writes the session to `path`."""
    with Recording(path, provenance=provenance(), overwrite=overwrite) as recording:
        for receive_ns, topic, message in traffic(truth=truth):
            recording.write_message(topic, message, receive_ns=receive_ns)
    return path
