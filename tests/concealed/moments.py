# ruff: noqa: PLR0917 (short rows of numbers read better by place)
"""The rare messages of a session: phases, commands, motions, samples, calibration, clocks, the air."""

from __future__ import annotations

import math
from collections.abc import Iterator

from shared import frames
from shared.messages import (
    REPLACED,
    AgentStatus,
    CameraGeometry,
    ClockOffset,
    Environment,
    Message,
    MotionReport,
    RunEvent,
    Sample,
    TiltCommand,
)
from tests.concealed.design import PAIRS, Design
from tests.concealed.measure import ns_of, read_run
from tests.concealed.ride import COMMAND_DELAY
from tests.concealed.session import START_K, RunRecord, SessionRecord
from tests.concealed.streams import BOOT_ID, EXPOSURE_NS
from tests.concealed.view import CENTRE_PX
from tests.concealed.world import BASE_HZ, FRAME, World

Moment = tuple[str, int, int, Message]
"""Topic, capture and receipt (ns), message."""
_SECOND_NS = 1_000_000_000


def moments_of(session: SessionRecord) -> Iterator[Moment]:
    """Every rare message, run after run (not yet in the order of time)."""
    yield from _sync(session)
    for run in session.runs:
        yield from _run(run, session.setting.design, session.setting.world)
    yield from _every_second(session)


def geometry_of(world: World, *, stamp_ns: int) -> CameraGeometry:
    """The calibration: the nominal view, straight down at the plate's centre."""
    scale = 1.0 / world.px_per_m
    return CameraGeometry(
        stamp_ns=stamp_ns,
        plate_from_pixel=(scale, 0.0, -scale * CENTRE_PX, 0.0, -scale, scale * CENTRE_PX, 0.0, 0.0, 1.0),
        mm_per_px=1e3 * scale,
        marker_side_m=world.mark_side,
        marker_aspect=1.0,
        mark_height_m=world.mark_height,
        camera_height_m=world.camera_height,
        source="nominal: rig.toml",
    )


def _event(run: int, phase: str, k: float, *, reason: str = "", step: int = 0, late_ns: int = 0) -> Moment:
    stamp = ns_of(k) + late_ns
    return "session/event", stamp, stamp + 200_000, RunEvent(stamp, run, phase, reason, step)


def _motion(run: int, step: int, begin_k: float, end_k: float, *, fault: str = "") -> Iterator[Moment]:
    """A motion's two reports, and the events that the station makes of them."""
    begin, end = ns_of(begin_k), ns_of(end_k)
    yield "arm/motion", begin, begin + 700_000, MotionReport(begin, run, step, begin, 0, "")
    yield _event(run, "STEP_BEGIN", begin_k, step=step)
    yield "arm/motion", end, end + 700_000, MotionReport(end, run, step, begin, end, fault)
    if not fault:
        yield _event(run, "STEP_END", end_k, step=step)


def _command(run: int, step: int, k: float, angle: float, rate: float, toward: tuple[int, float]) -> Moment:
    stamp = ns_of(k)
    return "arm/command", stamp, stamp + 100_000, TiltCommand(stamp, run, *toward, angle, step, rate)


def _sync(session: SessionRecord) -> Iterator[Moment]:
    rate = math.radians(8.0)
    up, over, down = 0.4 * BASE_HZ, 1.0 * BASE_HZ, 1.6 * BASE_HZ
    yield _event(0, "SYNC", up - COMMAND_DELAY, reason="a small tilt, seen by arm and camera")
    yield _command(0, 1, up - COMMAND_DELAY, math.radians(2.0), rate, (0, 0.0))
    yield from _motion(0, 1, up, over)
    yield _command(0, 2, over + 1, 0.0, rate, (0, 0.0))
    yield from _motion(0, 2, over + 2, down)


def _run(run: RunRecord, design: Design, world: World) -> Iterator[Moment]:
    number, done = int(run.facts.number) + 1, run.ride
    toward = (run.direction, run.facts.azimuth)
    tilt_at, detect, back, level, end = (int(k) for k in done.marks)
    yield _event(number, "LEVEL", run.from_k)
    yield _command(number, 0, run.from_k, 0.0, run.program.return_rate, toward)
    yield from _motion(number, 0, run.from_k + COMMAND_DELAY, run.from_k + 2 * COMMAND_DELAY)
    yield _event(number, "DWELL", run.from_k + 2 * COMMAND_DELAY)
    yield _event(number, "REFERENCE", max(tilt_at - 10 * FRAME, run.from_k + 3 * COMMAND_DELAY))
    yield _event(number, "TILT", tilt_at, reason=f"direction {toward[0]}, azimuth {math.degrees(toward[1]):.0f} deg")
    for step, (times, angle) in enumerate(zip(done.step_at, done.step_angle, strict=True), start=1):
        yield _command(number, step, times[0], float(angle), run.program.rate, toward)
        replaced = step == done.steps and times[2] >= back
        yield from _motion(number, step, times[1], times[2], fault=REPLACED if replaced else "")
    late_ns = round(world.late_s * 1e9)
    if detect >= 0:
        yield _event(number, "SLIP", detect, late_ns=late_ns)
        yield _event(number, "SETTLE", detect + 1, late_ns=late_ns)
    yield _event(number, "RETURN", back + 2)
    yield _command(number, len(run.angles) + 1, back + 2, 0.0, run.program.return_rate, toward)
    yield from _motion(number, len(run.angles) + 1, back + COMMAND_DELAY, level)
    yield _event(number, "DONE", end)
    seen = ns_of(detect if detect >= 0 else back) + late_ns
    yield "session/sample", seen, ns_of(end) + 300_000, _sample(run, design, world, number, seen)


def _sample(run: RunRecord, design: Design, world: World, number: int, detect_ns: int) -> Sample:
    read = read_run(run, world)
    block, plate, _, _ = PAIRS[design.pair]
    rest_k = math.ceil(run.rest_at / FRAME) * FRAME
    return Sample(
        run=number,
        start_ns=ns_of(run.from_k),
        slip_ns=read.slip_ns,
        detect_ns=detect_ns,
        euler_rad=read.euler_rad,
        reference_corners_px=tuple(read.reference_px.tolist()),
        corner_variance_px2=tuple(read.variance_px2.tolist()),
        post_corners_px=tuple(read.post_px.tolist()),
        direction=run.direction,
        azimuth_rad=run.facts.azimuth,
        dwell_s=(int(run.ride.marks[0]) - rest_k) / BASE_HZ,
        tilt_rate_rad_s=run.program.rate,
        onset_angle_rad=read.onset_rad,
        onset_sigma_rad=read.onset_sigma_rad,
        flags=read.flags,
        plate_mount_rad=run.facts.mount,
        block_mass_kg=run.facts.mass,
        block_area_m2=world.side**2,
        object=f"{block} cube",
        plate=plate,
        temperature_c=round(run.temperature, 2),
        relative_humidity=round(run.humidity, 1),
        censored=run.censored,
        previous_direction=run.previous,
        rest_ns=ns_of(rest_k),
        step_from_rad=read.bracket_rad[0],
        step_to_rad=read.bracket_rad[1],
        start_x_m=read.start[0],
        start_y_m=read.start[1],
        start_yaw_rad=read.start[2],
    )


def _every_second(session: SessionRecord) -> Iterator[Moment]:
    """Calibration, clocks, the camera's state and the air, once a second from the beginning to the end."""
    world, runs = session.setting.world, session.runs
    end_k = int(runs[-1].ride.marks[4])
    at_run = 0
    first = geometry_of(world, stamp_ns=1)
    intrinsics = frames.pinhole_of(first)
    for k in range(FRAME, end_k, BASE_HZ):
        stamp = ns_of(k)
        while at_run + 1 < len(runs) and runs[at_run + 1].from_k <= k:
            at_run += 1
        run = runs[at_run]
        yield "camera/geometry", stamp, stamp + 1_000_000, geometry_of(world, stamp_ns=stamp)
        lens = frames.calibration(width_px=600, height_px=600, K=intrinsics, stamp_ns=stamp)
        yield "camera/calibration", stamp, stamp + 1_000_000, lens
        status = AgentStatus(
            stamp, frames=(k // FRAME), exposure_ns=EXPOSURE_NS, gain=1.0, temperature_c=48.0, cpu_percent=21.0,
            version="0.1.0", rate_hz=90.0, boot_id=BOOT_ID,
        )  # fmt: skip
        yield "camera/status", stamp, stamp + 1_000_000, status
        for agent in ("camera", "arm"):
            yield "clock", stamp, stamp + 100_000, ClockOffset(stamp, agent, 0, 150_000, 900_000)
        air = Environment(stamp, round(run.temperature, 2), round(run.humidity, 1))
        yield "environment", stamp, stamp + 1_000_000, air


__all__ = ["START_K", "geometry_of", "moments_of"]
