"""A session in real time over the bus: presence of the others, clocks, recorder, view, and a safe end."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack

from shared.bus import Bus, Received
from shared.clock import Clock
from shared.errors import UserError
from shared.messages import ArmReply, CameraGeometry, MotionReport, TiltCommand
from shared.rig import RigConfig
from station.app import assembly
from station.app.clocks import ClockKeeper
from station.app.control import SessionControl
from station.app.notify.watch import Watch
from station.app.processes import StopRequest
from station.app.session import Session
from station.recording.recorder import Recorder
from station.recording.writer import Recording
from station.rig.agreement import disagreement
from station.sampling.plan import Plan

PRESENCE_S = 2.0
LEVELLING_S = 20.0
_LAST_S = 0.5
_START = {
    "camera": "pi-agent run --rig RIG.toml (on the Pi; --camera synthetic for the simulated rig)",
    "arm": "station arm --rig RIG.toml",
    "twin": "station twin --rig RIG.toml",
}


def await_processes(bus: Bus, rig: RigConfig, *, timeout_s: float = PRESENCE_S) -> None:
    """Waits for everybody whom the session needs.

    Raises:
        UserError: naming who is missing and what to start.
    """
    needed = {"camera", "arm"} | ({"twin"} if assembly.arm_settings(rig).driver == "simulated" else set[str]())
    end = time.monotonic() + timeout_s
    while missing := needed - bus.alive():
        if time.monotonic() > end:
            what = "; ".join(
                f"no {name} on the bus of rig '{rig.id}': start {_START[name]}" for name in sorted(missing)
            )
            raise UserError(f"Expected {', '.join(sorted(needed))} within {timeout_s:g} s; {what}")
        bus.poll(0.05)


class LiveSession:
    """Runs a plan on a real (or simulated, but real-time) rig and records it."""

    def __init__(
        self,
        bus: Bus,
        rig: RigConfig,
        plan: Plan,
        *,
        recording: Recording,
        clock: Clock,
        stop: StopRequest,
        on_line: Callable[[str, str], None],
        owner: str = "",
        watch: Watch | None = None,
    ) -> None:
        """`watch` tells somebody of what the session needs."""
        self._bus, self._clock, self._stop, self._watch = bus, clock, stop, watch
        self._rig, self._doubt, self._unrecorded = rig, "", ""
        self._recorder = Recorder(bus, recording, clock=clock, on_stopped=self._on_stopped)
        machine = assembly.sampling_machine(rig, plan)
        self._session = Session(
            bus,
            machine,
            block_height_m=rig.block.size_m[2],
            pivot_above_plate_m=assembly.arm_settings(rig).pivot_above_plate_m or 0.005,
            on_line=on_line,
            owner=owner,
        )
        self._clocks = ClockKeeper(bus, clock=clock, agents=("camera", "arm"))
        self._control = SessionControl(bus, plan, stop=stop, owner=owner, recording=recording.path.name)
        self._settled: TiltCommand | None = None
        self._arm_there = True
        bus.subscribe("arm/motion", self._on_outcome)
        bus.subscribe("arm/reply", self._on_outcome)
        bus.subscribe("camera/geometry", self._on_geometry)
        if watch is not None:
            watch.attach(bus, machine, on_failure=lambda text: self._session.say("warning", text))

    @property
    def samples(self) -> int:
        """The number of runs that have given a sample."""
        return self._session.machine.samples

    def run(self, *, on_tick: Callable[[], None] = lambda: None) -> str:
        """Runs to the end; gives an empty text or why the session had to stop, or is not recorded to its end.

        The recording is closed either way.
        """
        with ExitStack() as stack:
            stack.callback(self._recorder.close)
            while not self._session.finished:
                if self._stop.reason:
                    self._session.say("warning", f"ending the session: {self._stop.reason}")
                    self._session.stop(self._stop.reason, now_ns=self._clock.now_ns())
                    break
                self._turn()
                on_tick()
            self._await_level()
            self._session.armed = False
            self._listen_on()
        reasons = (self._session.fault or self._stop.reason, self._unrecorded)
        return "; ".join(dict.fromkeys(reason for reason in reasons if reason))

    def _turn(self) -> None:
        self._bus.poll(0.004)
        now_ns = self._clock.now_ns()
        self._session.tick(now_ns)
        self._clocks.tick(now_ns)
        self._control.tick(now_ns, samples=self.samples)
        self._watch_arm()
        if self._watch is not None:
            self._watch.tick(now_ns)

    def _on_stopped(self, reason: str) -> None:
        """Stops the session, as the recording had to stop; called on the recorder's thread, or as that is closed."""
        self._unrecorded = reason
        self._stop.ask(reason)
        if self._watch is not None:
            self._watch.stopped_recording(reason)

    def _watch_arm(self) -> None:
        there = "arm" in self._bus.alive()
        if self._arm_there and not there:
            self._session.arm_is_gone()
        self._arm_there = there

    def _on_geometry(self, received: Received) -> None:
        """Warns of a camera agent with another rig file; once, as it says the same every second."""
        seen = received.message
        doubt = disagreement(self._rig, seen) if isinstance(seen, CameraGeometry) else ""
        if doubt and doubt != self._doubt:
            self._session.say("warning", doubt)
        self._doubt = doubt

    def _on_outcome(self, received: Received) -> None:
        """Notices that the last motion asked for is over, in whatever way, or will never begin."""
        message, asked = received.message, self._session.asked
        over = message.end_ns or message.fault if isinstance(message, MotionReport) else False
        refused = isinstance(message, ArmReply) and not message.accepted
        if asked is not None and (over or refused) and (message.run, message.step) == (asked.run, asked.step):  # pyright: ignore[reportAttributeAccessIssue]
            self._settled = asked

    def _listen_on(self) -> None:
        """Listens on, as the last messages are still on their way to the recorder."""
        end = time.monotonic() + _LAST_S
        while time.monotonic() < end:
            self._turn()

    def _await_level(self) -> None:
        """Keeps the heart beating until the plate is level again, if it had to be brought back."""
        asked = self._session.asked
        if asked is None or not (self._stop.reason or self._session.fault):
            return
        end = time.monotonic() + LEVELLING_S
        while self._settled is not asked and time.monotonic() < end and self._stop.times < 2:
            self._turn()
