"""The arm agent: commands come in from the bus, pass planner and gate, and reach the driver; state goes out.

`tick(now_ns)` drives everything, in real time by `station.arm.loop` and in simulated time by the lockstep scheduler.
The agent goes on watching, holding and levelling when the station is gone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from shared.bus import Bus, Received
from shared.errors import UserError
from shared.foxglove import Log, Timestamp
from shared.messages import (
    REPLACED,
    ArmLease,
    ArmReply,
    ArmStop,
    Heartbeat,
    JointState,
    LeaseRequest,
    Message,
    MotionReport,
    TiltCommand,
)
from station.arm.attitude import Attitude
from station.arm.drivers import Driver, DriverLink, JointReading, load_driver
from station.arm.gate import Action, SafetyGate
from station.arm.kept_stop import KeptStop
from station.arm.tilter import Plan, Tilter
from station.rig.arm_settings import ArmSettings

Array = NDArray[np.float64]
INFO, WARNING, ERROR = 2, 3, 4


@dataclass(frozen=True, slots=True, kw_only=True)
class _Motion:
    """A motion under way: the plan, when it began (agent's clock), and the command that it answers."""

    plan: Plan
    run: int
    step: int
    owner: str = ""
    """The session that commanded it."""
    began_ns: int = 0
    end_ns: int = 0
    """The time at which the last set-point is due, ns."""
    own_order: bool = False
    """True for holding or levelling after a lost heartbeat."""
    passing: bool = False
    """True if the network is the reason for this motion."""

    def begun(self, now_ns: int) -> _Motion:
        """Returns the same motion, beginning now."""
        return replace(self, began_ns=now_ns, end_ns=now_ns + self.plan.motion.trajectory.duration_ns)


class ArmAgent:
    """Joins one arm to the bus. Build it with `arm_agent`."""

    def __init__(
        self,
        bus: Bus,
        *,
        tilter: Tilter,
        driver: Driver,
        gate: SafetyGate,
        settings: ArmSettings,
        kept: KeptStop | None = None,
    ) -> None:
        self._bus = bus
        self._tilter = tilter
        self._attitude = Attitude(tilter.stage)
        self._driver = driver
        self._gate = gate
        self._settings = settings
        self._kept = kept
        self._now_ns = 0
        self._published_ns = -1
        self._reading: JointReading | None = None
        self._pending: _Motion | None = None
        self._motion: _Motion | None = None
        self._said = ""
        self._leased, self._lease_ns = ("", ""), 0
        bus.serve("arm/lease", self._on_lease)
        bus.serve("arm/command", self._on_command)
        bus.serve("arm/stop", self._on_stop)
        bus.subscribe("session/heartbeat", self._on_heartbeat)
        bus.announce("arm")

    @property
    def tilter(self) -> Tilter:
        """The planner's memory: the arm in its place and the paths already solved."""
        return self._tilter

    # --- from the bus -------------------------------------------------------------------------------------------------

    def _on_heartbeat(self, received: Received) -> None:
        if isinstance(received.message, Heartbeat):
            self._gate.heartbeat(received.message, now_ns=self._now_ns)

    def _on_lease(self, message: Message) -> ArmReply:
        if not isinstance(message, LeaseRequest):
            return ArmReply(reason="Expected a LeaseRequest.")
        if refused := self._gate.claim(message, now_ns=self._now_ns):
            self._log(WARNING, f"refused to session {message.owner}: {refused}")
            return ArmReply(reason=refused, stamp_ns=self._now_ns)
        return ArmReply(accepted=True, stamp_ns=self._now_ns)

    def _on_stop(self, message: Message) -> ArmReply:
        self.stop(message.reason if isinstance(message, ArmStop) else "")
        return ArmReply(accepted=True)

    def stop(self, reason: str) -> None:
        """Stops the arm at once, by the bus or by a signal, until the next session arms it."""
        self._gate.stop(reason, now_ns=self._now_ns)
        self._halt(f"emergency stop: {reason or 'no reason given'}")
        self._keep_stop()

    def _on_command(self, message: Message) -> ArmReply:
        if not isinstance(message, TiltCommand):
            return ArmReply(reason="Expected a TiltCommand.")
        try:
            self._accept(message)
        except UserError as refused:
            self._log(WARNING, f"command refused: {refused}")
            return self._reply(message, reason=str(refused))
        return self._reply(message)

    def _reply(self, command: TiltCommand, *, reason: str = "") -> ArmReply:
        passing = bool(reason) and self._gate.beat_lost()
        return ArmReply(not reason, reason, self._now_ns, command.run, command.step, passing)

    def _accept(self, command: TiltCommand) -> None:
        """Plans a command and queues it for the next tick; raises UserError when it is refused."""
        if reason := self._gate.readiness(now_ns=self._now_ns, owner=command.owner):
            raise UserError(reason)
        self._require_pose()
        rate = command.rate_rad_s or math.radians(self._settings.rate_deg_s)
        plan = self._tilter.plan(command, elapsed_ns=self._elapsed_ns(), rate_rad_s=rate)
        if reason := self._gate.check(plan.motion.trajectory, now_ns=self._now_ns, reading=self._reading):
            raise UserError(reason)
        self._pending = _Motion(plan=plan, run=command.run, step=command.step, owner=command.owner)

    def _require_pose(self) -> None:
        """Finds out, before the first motion and after a fault, at which tilt the arm stands."""
        if self._tilter.located:
            return
        if self._reading is None:
            raise UserError(self._driver.fault() or "The arm does not report its joints: check its power and cable.")
        if float(np.abs(self._reading.velocity_rad_s).max()) > _REST_RAD_S:
            raise UserError("The arm moves by itself: wait until it rests, then command it again.")
        self._tilter.locate(self._reading.position_rad)

    def _elapsed_ns(self) -> int:
        return self._now_ns - self._motion.began_ns if self._motion else 0

    # --- time ---------------------------------------------------------------------------------------------------------

    def tick(self, now_ns: int) -> None:
        """Does everything that is due at `now_ns`: begins what was accepted, watches, drives, publishes."""
        self._now_ns = now_ns
        self._revoke()
        self._begin_pending()
        self._driver.tick(now_ns)
        self._reading = self._driver.read()
        self._watch()
        self._finish()
        self._publish_state()
        self._publish_lease()
        self._keep_stop()

    def _revoke(self) -> None:
        """Ends what a session has commanded that has lost the arm since, or disarmed: planning and moving take time."""
        pending, motion = self._pending, self._motion
        commanded = pending if pending and not pending.own_order else None
        if commanded and (reason := self._gate.readiness(now_ns=self._now_ns, owner=commanded.owner)):
            self._give_up(reason)
        if motion and self._pending is None and (reason := self._gate.revoked(motion.owner)):
            self._hold(reason)

    def _give_up(self, reason: str) -> None:
        """Drops what has not begun, and says so to the session that waits for it."""
        pending, self._pending = self._pending, None
        if pending is not None and not pending.own_order:
            never = replace(pending, began_ns=self._now_ns)
            self._report(never, end_ns=self._now_ns, fault=reason, passing=self._gate.beat_lost())

    def _begin_pending(self) -> None:
        if self._pending is None:
            return
        if self._motion is not None:
            why = self._said if self._pending.own_order else REPLACED
            self._report(self._motion, end_ns=self._now_ns, fault=why, passing=self._pending.passing)
        self._motion = self._pending.begun(self._now_ns)
        self._pending = None
        self._tilter.begin(self._motion.plan)
        self._driver.start(self._motion.plan.motion.trajectory, now_ns=self._now_ns)
        self._report(self._motion)

    def _commanded(self) -> Array | None:
        """Returns the joint angles (n,) that were commanded for the moment of the reading; None when nothing moves."""
        if self._motion is None or self._reading is None:
            return None
        elapsed = min(self._reading.stamp_ns, self._now_ns) - self._motion.began_ns
        return self._motion.plan.motion.trajectory.at(elapsed)[0]

    def _watch(self) -> None:
        verdict = self._gate.watch(now_ns=self._now_ns, reading=self._reading, commanded=self._commanded())
        if fault := self._driver.fault():
            self._lose(fault)
        elif verdict.action is Action.NONE:
            self._said = ""
        elif verdict.action is Action.HALT:
            self._halt(verdict.reason)
        elif verdict.action is Action.HOLD:
            self._hold(verdict.reason, passing=True)
        else:
            self._level(verdict.reason)

    def _lose(self, fault: str) -> None:
        """Stops an arm that does not do its part; the next command begins where it then stands, not where it should."""
        if self._motion is None:
            self._say_once(fault)
        self._halt(fault)
        self._tilter.forget()

    def _halt(self, reason: str) -> None:
        """Stops the motion under way at once, where it is, and says why; what has not begun never will."""
        motion, self._motion = self._motion, None
        if motion is not None:
            passing_ns = self._driver.halt(now_ns=self._now_ns) or 0  # a driver to the older contract returns nothing
            self._tilter.halt(elapsed_ns=self._now_ns - motion.began_ns + passing_ns)
            self._report(motion, end_ns=self._now_ns, fault=reason)
            self._log(ERROR, f"motion stopped: {reason}")
        self._give_up(reason)

    def _hold(self, reason: str, *, passing: bool = False) -> None:
        """Brings a commanded motion to rest smoothly, on the gate's order."""
        if self._motion is None or self._motion.own_order:
            return
        self._say_once(reason)
        self._obey(self._tilter.plan_hold(elapsed_ns=self._elapsed_ns()), passing=passing)

    def _level(self, reason: str) -> None:
        """Brings the plate back to level slowly, on the gate's order."""
        if self._motion is not None or not self._tilter.located or self._tilter.state(0).angle_rad < 1e-4:
            return
        self._say_once(reason)
        rate = math.radians(self._settings.gate.level_rate_deg_s)
        self._obey(self._tilter.plan(TiltCommand(direction=-1), elapsed_ns=0, rate_rad_s=rate))

    def _obey(self, plan: Plan, *, passing: bool = False) -> None:
        """Begins a motion of the gate's own at the next tick; halts if it may not be."""
        fault = self._gate.check(plan.motion.trajectory, now_ns=self._now_ns, reading=self._reading, own_order=True)
        if fault:
            self._halt(fault)
            self._say_once(fault)
        else:
            self._pending = _Motion(plan=plan, run=-1, step=0, own_order=True, passing=passing)

    def _finish(self) -> None:
        """Ends the motion once the arm has arrived and rests, or says that it has not."""
        motion = self._motion
        if motion is None or self._now_ns < motion.end_ns or self._reading is None:
            return
        goal = motion.plan.motion.trajectory.position_rad[-1]
        away = float(np.abs(self._reading.position_rad - goal).max())
        speed = float(np.abs(self._reading.velocity_rad_s).max())
        if self._reading.stamp_ns < motion.end_ns or not (
            away <= math.radians(self._settings.gate.settle_tolerance_deg) and speed <= _REST_RAD_S
        ):
            if self._now_ns - motion.end_ns > self._settings.gate.settle_timeout_s * 1e9:
                self._halt(f"the arm did not come to rest: {math.degrees(away):.2f} degrees from its goal")
            return
        self._motion = None
        self._tilter.halt(elapsed_ns=motion.end_ns - motion.began_ns)
        self._report(motion, end_ns=self._now_ns)

    # --- to the bus ---------------------------------------------------------------------------------------------------

    def _publish_state(self) -> None:
        reading = self._reading
        if reading is None or reading.stamp_ns <= self._published_ns:
            return
        self._published_ns = reading.stamp_ns
        if self._bus.carries("arm/joints"):
            self._bus.publish("arm/joints", _joint_state(reading))
        self._bus.publish("arm/platform", self._attitude.state(reading))

    def _publish_lease(self) -> None:
        """Publishes lease and stop once a second and when they change, for a session without a name and lookers-on."""
        lease = (self._gate.owner or "", self._gate.stopped)
        if lease != self._leased or (any(lease) and self._now_ns - self._lease_ns >= _LEASE_NS):
            self._leased, self._lease_ns = lease, self._now_ns
            self._bus.publish("arm/lease", ArmLease(self._now_ns, *lease))

    def _keep_stop(self) -> None:
        """Keeps the stop in force where the next agent of this rig finds it; a new one before it is answered."""
        try:
            if self._kept is not None:
                self._kept.keep(self._gate.stopped)
        except OSError as fault:
            self._log(ERROR, f"the next arm agent will not know whether the arm is stopped: {fault}")

    def _report(self, motion: _Motion, *, end_ns: int = 0, fault: str = "", passing: bool = False) -> None:
        self._bus.publish(
            "arm/motion",
            MotionReport(self._now_ns, motion.run, motion.step, motion.began_ns, end_ns, fault, passing),
        )

    def _say_once(self, text: str) -> None:
        if text != self._said:
            self._said = text
            self._log(WARNING, text)

    def _log(self, level: int, text: str) -> None:
        stamp = Timestamp.from_ns(self._now_ns)
        self._bus.publish("log", Log(timestamp=stamp, level=level, message=text, name="arm"))

    def close(self) -> None:
        """Holds the arm and lets go of the driver."""
        self._halt("the arm agent ends")
        self._driver.close()


def _joint_state(reading: JointReading) -> JointState:
    position, velocity = tuple(reading.position_rad.tolist()), tuple(reading.velocity_rad_s.tolist())
    return JointState(reading.stamp_ns, reading.names, position, velocity, tuple(reading.effort_nm.tolist()))


_LEASE_NS = 1_000_000_000
_REST_RAD_S = math.radians(0.5)


def arm_agent(
    bus: Bus,
    settings: ArmSettings,
    *,
    driver: Driver | None = None,
    tilter: Tilter | None = None,
    kept: KeptStop | None = None,
) -> ArmAgent:
    """Returns the agent for the `[arm]` table of a rig: model, placement, driver and gate put together.

    A `tilter` of these settings that has not moved yet brings the paths that it has solved. `kept` brings the stop that
    an agent before has left in force; a simulated arm, which nobody can start again, needs none. Raises UserError with
    one sentence when they do not fit.
    """
    tilter = tilter or Tilter.from_settings(settings)
    if driver is None:
        share = settings.gate.acceleration_share
        link = DriverLink(bus=bus, model=tilter.stage.model, options=settings.options, acceleration_share=share)
        driver = load_driver(settings.driver, link=link)
    stopped = kept.read() if kept is not None else ""
    gate = SafetyGate(tilter.stage, settings=settings.gate, may_arm=settings.may_arm, stopped=stopped)
    return ArmAgent(bus, tilter=tilter, driver=driver, gate=gate, settings=settings, kept=kept)
