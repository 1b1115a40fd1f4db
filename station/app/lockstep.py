"""A whole session in simulated time in one process: the same twin, arm agent, state machine and recorder as live."""

from __future__ import annotations

import gc
import heapq
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from shared.bus import Bus
from shared.clock import SIMULATION_EPOCH_NS, SimulatedClock
from shared.memory_bus import MemoryBus
from shared.messages import ClockOffset
from shared.rig import RigConfig
from station.app import assembly
from station.app.processes import StopRequest
from station.app.session import Session
from station.app.twin_wire import DirectWire
from station.arm.agent import arm_agent
from station.arm.drivers.simulated import SimulatedArm
from station.arm.tilt_path import TiltStage
from station.arm.tilter import Tilter
from station.recording.recorder import Sink, record_within
from station.sampling.plan import Plan
from station.simulators.mujoco.twin import Twin
from station.simulators.mujoco.world import TwinWorld
from station.simulators.projected_camera import ProjectedCamera, ProjectionSettings

ARM_NS = 10_000_000
SESSION_NS = 16_666_667
SECOND_NS = 1_000_000_000
ARM, CAMERA, SESSION, CLOCK = range(4)
"""The order of those that are due at the same moment."""


class LockstepCamera(Protocol):
    """A camera in simulated time."""

    def tick(self, now_ns: int) -> None:
        """Takes the frame whose exposure has its middle at `now_ns`, and publishes what it shows."""
        ...


CameraBuilder = Callable[[Bus, RigConfig, Twin], LockstepCamera]
"""Sets a camera up in front of a twin."""


class WorldBuilder(Protocol):
    """Makes the world of a rig: `assembly.twin_world`, or another."""

    def __call__(self, rig: RigConfig, *, seed: int, start_ns: int, stage: TiltStage | None = None) -> TwinWorld:
        """Makes the world of `rig`; a known `stage` saves solving for the arm's home."""
        ...


@dataclass(frozen=True, slots=True)
class Outcome:
    """The end of a session: `fault` is empty or says why it stopped; `simulated_s` is the rig's own time."""

    samples: int
    simulated_s: float
    fault: str


class Lockstep:
    """One simulated session. Build it, then `run` it."""

    def __init__(
        self,
        rig: RigConfig,
        plan: Plan,
        *,
        recording: Sink | None,
        camera: CameraBuilder | None = None,
        world: WorldBuilder = assembly.twin_world,
        on_line: Callable[[str, str], None] = lambda _level, _text: None,
        left_out: frozenset[str] = frozenset(),
        tilter: Tilter | None = None,
    ) -> None:
        """Sets everything up; nobody gets messages of topics that are `left_out`.

        A new `tilter` of the same rig saves solving the paths that it knows.
        """
        self.clock = SimulatedClock()
        self.bus = MemoryBus(self.clock, left_out=left_out)
        self._recording = recording
        if recording is not None:
            record_within(self.bus, recording)
        twin_seed, camera_seed = np.random.SeedSequence(plan.seed).generate_state(2)
        settings = assembly.arm_settings(rig)
        tilter = tilter or Tilter.from_settings(settings)
        made = world(rig, seed=int(twin_seed), start_ns=self.clock.now_ns(), stage=tilter.stage)
        self.twin = Twin(self.bus, made, scene_period_ns=SECOND_NS // 30)
        self._arm = arm_agent(self.bus, settings, driver=SimulatedArm(DirectWire(made)), tilter=tilter)
        self._camera = (camera or projected_camera(int(camera_seed)))(self.bus, rig, self.twin)
        machine = assembly.sampling_machine(rig, plan, tilter=self._arm.tilter)
        self.session = Session(
            self.bus,
            machine,
            block_height_m=rig.block.size_m[2],
            pivot_above_plate_m=made.arm.pivot_above_plate_m,
            on_line=on_line,
        )
        self._frame_ns = round(SECOND_NS / rig.camera.rate_hz)

    def run(
        self,
        *,
        on_sample: Callable[[int], None] = lambda _count: None,
        limit_s: float = float("inf"),
        stop: StopRequest | None = None,
    ) -> Outcome:
        """Runs until plan or `limit_s` (simulated time) are over, or session or recording had to stop, or was asked to.

        A session that was asked to stop does not wait until the plate is level.
        """
        start, stop = SIMULATION_EPOCH_NS, stop or StopRequest()
        with _without_garbage_collection():
            samples = self._run(start, on_sample=on_sample, limit_s=limit_s, stop=stop)
        simulated = (self.clock.now_ns() - start) * 1e-9
        stopped = self._recording.stopped if self._recording is not None else ""
        return Outcome(samples=samples, simulated_s=simulated, fault=self.session.fault or stopped or stop.reason)

    def _run(self, start: int, *, on_sample: Callable[[int], None], limit_s: float, stop: StopRequest) -> int:
        """Runs the loop: does whatever is due first, and of what is due together the one that stands first here."""
        due = [
            (start, ARM, ARM_NS, self._tick_arm),
            (start, SESSION, SESSION_NS, self._tick_session),
            (start, CLOCK, SECOND_NS, self._tick_clock),
            (start + ARM_NS, CAMERA, self._frame_ns, self._tick_camera),
        ]
        end_ns = start + limit_s * 1e9
        session, machine, samples = self.session, self.session.machine, 0
        turn, advance_to = heapq.heapreplace, self.clock.advance_to
        now_ns = start
        while not session.finished and now_ns < end_ns:
            now_ns, rank, period_ns, what = due[0]
            turn(due, (now_ns + period_ns, rank, period_ns, what))
            advance_to(now_ns)
            what(now_ns)
            if rank != SESSION:
                continue
            if machine.samples != samples:
                samples = machine.samples
                on_sample(samples)
            if stop.reason:
                session.stop(stop.reason, now_ns=now_ns)
            if self._recording is not None and self._recording.stopped:
                break
        return machine.samples

    def _tick_arm(self, now_ns: int) -> None:
        self.twin.world.advance(now_ns)
        self.twin.show(now_ns)
        self._arm.tick(now_ns)

    def _tick_camera(self, now_ns: int) -> None:
        self.twin.world.advance(now_ns)
        self._camera.tick(now_ns)

    def _tick_session(self, now_ns: int) -> None:
        self.session.tick(now_ns)

    def _tick_clock(self, now_ns: int) -> None:
        """Says that the offsets are zero, as one clock drives all."""
        for agent in ("camera", "arm"):
            self.bus.publish("clock", ClockOffset(stamp_ns=now_ns, agent=agent))


@contextmanager
def _without_garbage_collection() -> Generator[None]:
    """Collects no garbage: nothing in the loop makes cycles of objects, and looking for them costs a tenth of it."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


def projected_camera(seed: int, *, sigma_px: float = ProjectionSettings.sigma_px) -> CameraBuilder:
    """Returns a builder of the camera without pixels, with that noise of a corner's coordinate."""

    def build(bus: Bus, rig: RigConfig, twin: Twin) -> ProjectedCamera:
        place = rig.plate.fiducial_place_mm * 1e-3
        return ProjectedCamera(
            bus,
            twin.world,
            geometry=assembly.nominal_geometry(rig),
            size_px=(rig.camera.width_px, rig.camera.height_px),
            fiducial_m=(-place, place),
            fiducial_side_m=rig.plate.fiducial_side_mm * 1e-3,
            rng=np.random.default_rng(seed),
            settings=ProjectionSettings(
                sigma_px=sigma_px,
                rate_hz=rig.camera.rate_hz,
                plate_rate_hz=rig.camera.plate_rate_hz,
                preview_hz=rig.camera.preview_hz,
                # The synthetic camera's own option: what can be had without pixels, this camera has as well.
                sag_px=float(rig.camera.options.values.get("sag_px", 0.0)),
            ),
        )

    return build
