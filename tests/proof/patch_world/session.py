"""A session: the sampling logic of every rig tilts this world's plate, and everything is recorded as it would be live.

The queue holds what is due, in ticks of 0.1 ms; a message is handled when it is received, some milliseconds after it
was measured. `Done` tells what was asked of the arm in each run, from where, for whoever wants to run it again.
"""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from shared.clock import SIMULATION_EPOCH_NS
from shared.messages import (
    REPLACED,
    AgentStatus,
    ArmReply,
    ClockOffset,
    Heartbeat,
    Message,
    MotionReport,
    RunEvent,
    Sample,
    TiltCommand,
)  # fmt: skip
from shared.rig import RigConfig
from station.recording.writer import Recording
from station.rig.opening import Opening
from station.sampling.actions import Action, Report, Tilt
from station.sampling.machine import INPUTS, SamplingMachine
from station.sampling.plan import Plan
from station.sampling.run import Specimen
from tests.proof.patch_world import places as at
from tests.proof.patch_world import rig as rigs
from tests.proof.patch_world import sensors
from tests.proof.patch_world.bench import TICK_S, Bench, Moment
from tests.proof.patch_world.camera import SIZE_PX, View
from tests.proof.patch_world.draws import run_draw
from tests.proof.patch_world.world import World

Array = NDArray[np.float64]
TICK_NS = round(TICK_S * 1e9)
_FRAME_TICKS = 10_000 / 90.0
_READING, _BEAT, _SECOND, _INCLINATION = 100, 500, 10_000, 500
_CAMERA_DELAY, _ARM_DELAY, _OBEYS, _SETTLES = 50, 10, 60, 500
"""The travel times of frames and readings, the arm's until it obeys and until it says that it has arrived (ticks)."""
_PLATE_EVERY = 6
_LIMIT = 10_000 * 7200


@dataclass(frozen=True, kw_only=True, slots=True)
class Asked:
    """A motion that the arm began: when (s), to which angle (rad), about which azimuth, how fast (rad/s)."""

    time_s: float
    angle: float
    azimuth: float
    rate: float


@dataclass(kw_only=True, slots=True)
class RunRecord:
    """One run as the generator knows it: its begin, what was asked of the arm, and the sample that came of it."""

    run: int
    azimuth: float
    before: float | None
    begin: Moment
    asked: list[Asked] = field(default_factory=list[Asked])
    states: list[Array] = field(default_factory=list[Array])
    """The bench's state at each frame."""
    detect_s: float = 0.0
    end_s: float = 0.0
    sample: Sample | None = None


class Session:
    """One session of a world. Build it, then `run` it."""

    def __init__(
        self, world: World, plan: Plan, recording: Recording, *, rig: RigConfig, seed: int, bench: Bench | None = None
    ) -> None:
        """`rig` is what the rig file says, which an effect may have made untrue; `bench` may be another one."""
        self.world, self._recording, self._seed = world, recording, seed
        self.rig = rig
        self._arm = rigs.Joints(self.rig)
        self.bench = bench or Bench(world)
        self._view = View(world.camera, rigs.mark_side_m(world.contact), world.contact.height)
        self._rng = np.random.default_rng([seed, 2])
        length, width, _ = self.rig.block.size_m
        specimen = Specimen(
            object=self.rig.block.name,
            plate=self.rig.plate.material,
            block_mass_kg=self.rig.block.mass_kg,
            block_area_m2=length * width,
            opening=Opening(radius_m=self.rig.plate.opening_m / 2, outline_m=self.rig.plate.opening_outline_m),
        )
        self._machine = SamplingMachine(
            plan, size_px=(SIZE_PX, SIZE_PX), reach=self._arm.reach, specimen=specimen, geometry=None
        )
        self._queue: list[tuple[int, int, Callable[..., None], tuple[object, ...]]] = []
        self._order = itertools.count()
        self._now = self._frames = self._published = self._run = 0
        self._motion: tuple[TiltCommand, int] | None = None
        self._finished = False
        self._fault = ""
        self._before: float | None = None
        self.runs: list[RunRecord] = []

    def run(self) -> str:
        """Runs the session to its end; returns an empty text, or why it stopped."""
        self.bench.begin_run(run_draw(self.world, seed=self._seed, run=0), run=0, azimuth=0.0, before=None)
        for what in (self._take_reading, self._beat, self._tell, self._take_inclination):
            self._at(0, what)
        self._at(100, self._take_frame)
        while not self._finished:
            self._now, _, what, values = heapq.heappop(self._queue)
            if self._now > _LIMIT:
                return "the session took more than two hours"
            what(*values)
        return self._fault

    # --- the queue and the bus ---------------------------------------------------------------------------------------

    def _at(self, tick: int, what: Callable[..., None], *values: object) -> None:
        heapq.heappush(self._queue, (tick, next(self._order), what, values))

    def _advance(self) -> None:
        self.bench.advance(self._now * TICK_S)

    def _ns(self) -> int:
        return SIMULATION_EPOCH_NS + self._now * TICK_NS

    def _send(self, topic: str, message: Message, *, delay: int) -> None:
        self._at(self._now + delay, self._receive, topic, message)

    def _receive(self, topic: str, message: Message) -> None:
        now_ns = self._ns()
        self._recording.write_message(topic, message, receive_ns=now_ns)
        if topic in INPUTS:
            for action in self._machine.handle(message, now_ns=now_ns):
                self._perform(action)

    def _perform(self, action: Action) -> None:
        if isinstance(action, Report):
            name = "session/event" if isinstance(action.message, RunEvent) else "session/sample"
            self._recording.write_message(name, action.message, receive_ns=self._ns())
            self._note(action.message)
        elif isinstance(action, Tilt):
            self._recording.write_message("arm/command", action.command, receive_ns=self._ns())
            self._at(self._now + _ARM_DELAY, self._answer, action.command)
            self._at(self._now + _OBEYS, self._begin, action.command)
        elif not hasattr(action, "text"):
            self._finished, self._fault = True, getattr(action, "fault", "")

    # --- the arm -----------------------------------------------------------------------------------------------------

    def _arm_ns(self) -> int:
        return self._ns() - round(self.world.sensing.stamp_s * 1e9)

    def _answer(self, command: TiltCommand) -> None:
        self._receive("arm/reply", ArmReply(accepted=True, stamp_ns=self._ns(), run=command.run, step=command.step))

    def _begin(self, command: TiltCommand) -> None:
        self._advance()
        if self._motion is not None:
            self._report(*self._motion, end=True, fault=REPLACED)
        asked = Asked(
            time_s=self._now * TICK_S, angle=command.angle_rad, azimuth=command.azimuth_rad, rate=command.rate_rad_s
        )
        if self.runs and self.runs[-1].run == command.run and not self.runs[-1].end_s:
            self.runs[-1].asked.append(asked)
        end_s = self.bench.ask(asked.angle, azimuth=asked.azimuth, rate=asked.rate)
        self._motion = (command, self._arm_ns())
        self._report(*self._motion, end=False)
        self._at(round(end_s / TICK_S) + _SETTLES, self._end, self._motion)

    def _end(self, motion: tuple[TiltCommand, int]) -> None:
        if self._motion is motion:
            self._motion = None
            self._report(*motion, end=True)

    def _report(self, command: TiltCommand, begin_ns: int, *, end: bool, fault: str = "") -> None:
        now_ns = self._arm_ns()
        report = MotionReport(
            stamp_ns=now_ns,
            run=command.run,
            step=command.step,
            begin_ns=begin_ns,
            end_ns=now_ns if end else 0,
            fault=fault,
        )
        self._send("arm/motion", report, delay=_ARM_DELAY)

    def _take_reading(self) -> None:
        self._advance()
        stamp_ns, sensing = self._arm_ns(), self.world.sensing
        state = sensors.attitude(self.bench, sensing, self._arm.pivot_m, stamp_ns=stamp_ns, rng=self._rng)
        self._send("arm/platform", state, delay=_ARM_DELAY)
        self._send("arm/joints", sensors.joints(self.bench, sensing, self._arm, stamp_ns=stamp_ns), delay=_ARM_DELAY)
        self._at(self._now + _READING, self._take_reading)

    def _take_inclination(self) -> None:
        self._advance()
        reading = sensors.inclination(self.bench, stamp_ns=self._ns(), rng=self._rng)
        self._send(f"angle/{sensors.INCLINOMETER}", reading, delay=_ARM_DELAY)
        self._at(self._now + _INCLINATION, self._take_inclination)

    # --- the camera --------------------------------------------------------------------------------------------------

    def _take_frame(self) -> None:
        self._advance()
        self._frames += 1
        self._at(100 + round(self._frames * _FRAME_TICKS), self._take_frame)
        if self._rng.random() < self.world.camera.skipped_share:
            return
        self._published += 1
        if self.runs and not self.runs[-1].end_s:
            self.runs[-1].states.append(self.bench.state.copy())
        azimuth, ns = float(self.bench.motion[at.AZIMUTH]), self._ns()
        if self._frames % _PLATE_EVERY == 1:
            seen = self._view.fiducial(self.bench.state, azimuth=azimuth, run=self._run)
            plate = sensors.frame(
                seen, self.world.camera, capture_ns=ns, seq=self._frames // _PLATE_EVERY + 1, marker=1, rng=self._rng
            )
            self._send("camera/plate", plate, delay=_CAMERA_DELAY)
        seen = self._view.block(self.bench.state, azimuth=azimuth, run=self._run)
        corners = sensors.frame(seen, self.world.camera, capture_ns=ns, seq=self._published, marker=0, rng=self._rng)
        self._send("camera/corners", corners, delay=_CAMERA_DELAY)

    # --- the station -------------------------------------------------------------------------------------------------

    def _beat(self) -> None:
        self._receive("session/heartbeat", Heartbeat(stamp_ns=self._ns(), armed=True))
        self._at(self._now + _BEAT, self._beat)

    def _tell(self) -> None:
        ns = self._ns()
        for agent in ("camera", "arm"):
            self._receive("clock", ClockOffset(stamp_ns=ns, agent=agent, sigma_ns=50_000, rtt_ns=300_000))
        self._receive("camera/geometry", rigs.geometry(self.world.contact, stamp_ns=ns))
        self._receive("camera/calibration", rigs.calibration(stamp_ns=ns))
        status = AgentStatus(
            stamp_ns=ns, frames=self._published, exposure_ns=2_000_000, gain=1.0, version="patch world", rate_hz=90.0
        )
        self._receive("camera/status", status)
        self._at(self._now + _SECOND, self._tell)

    def _note(self, message: RunEvent | Sample) -> None:
        """Keeps what the truth needs, and lays the block on a new contact when a run begins to tilt."""
        if isinstance(message, Sample):
            record = self.runs[-1]
            record.sample, record.end_s = message, self._now * TICK_S
            return
        self._run = message.run
        if message.phase == "TILT":
            self._advance()
            azimuth = _azimuth_of(message)
            draw = run_draw(self.world, seed=self._seed, run=message.run)
            self.bench.begin_run(draw, run=message.run, azimuth=azimuth, before=self._before)
            self.runs.append(
                RunRecord(run=message.run, azimuth=azimuth, before=self._before, begin=self.bench.moment())
            )
            self._before = azimuth
        elif message.phase == "SLIP":
            self.runs[-1].detect_s = (message.stamp_ns - SIMULATION_EPOCH_NS) * 1e-9


def _azimuth_of(event: RunEvent) -> float:
    """The azimuth (rad) that a TILT event names in its reason, in whole degrees, as all free azimuths are."""
    return float(np.radians(float(event.reason.rpartition("azimuth ")[2].removesuffix(" deg"))))
