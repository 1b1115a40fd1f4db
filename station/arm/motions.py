"""The arm's motions, one at a time: how an order becomes one, and how it ends.

A motion begins where the arm is. While one is under way its plan says where that is, and so it does once it arrived.
After a halt no plan does: then the arm is located by its readings, once it rests.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from shared.errors import UserError
from shared.messages import REPLACED, TiltCommand
from station.arm.announcements import ERROR, Announcements, Moment
from station.arm.drivers import Driver
from station.arm.gate import SafetyGate
from station.arm.tilter import Plan, Tilter
from station.rig.arm_settings import ArmSettings

Array = NDArray[np.float64]
_REST_RAD_S = math.radians(0.5)
_LEVEL_RAD = 1e-4
_AGAIN_NS = 10_000_000_000
"""The time between two tries to level a plate that the arm, jammed or switched off, does not level: each is three lines
on the bus, and whoever frees the arm waits no longer."""


_OWN = TiltCommand(run=-1, direction=-1)
"""The command of the agent itself, under whose run its motions are reported: level."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Order:
    """A motion that is wanted: a session's command, or one of the agent's own."""

    command: TiltCommand = _OWN
    rate_rad_s: float = 0.0
    rest: bool = False
    """True if the motion under way is to come to rest, which needs no command."""
    own: bool = False
    """True for holding and levelling, which the gate orders."""
    passing: bool = False
    """True if the network is the reason for this order."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """A motion under way: its order and plan, its begin, and when the last set-point is due (ns, agent's clock)."""

    order: Order
    plan: Plan
    began_ns: int
    end_ns: int


class Motions:
    """The motion under way, and the order that begins with the next tick."""

    def __init__(
        self,
        moment: Moment,
        *,
        tilter: Tilter,
        driver: Driver,
        gate: SafetyGate,
        settings: ArmSettings,
        announce: Announcements,
    ) -> None:
        self._moment, self._announce = moment, announce
        self._tilter, self._driver, self._gate = tilter, driver, gate
        self._settings = settings
        self._waiting: Order | None = None
        self._motion: Motion | None = None
        self._levelled_ns: int | None = None

    def accept(self, command: TiltCommand) -> None:
        """Takes a command, which begins with the next tick; raises UserError with the reason of a refusal.

        Its plan from where the arm was at the last tick says whether it may be, and is planned anew from where the arm
        is when it begins.
        """
        rate = command.rate_rad_s or math.radians(self._settings.rate_deg_s)
        order = Order(command=command, rate_rad_s=rate)
        self._planned(order)
        self._waiting = order

    def _planned(self, order: Order) -> Plan:
        """Returns the plan of an order from where the arm is now; raises UserError where it may not be carried out."""
        now_ns, gate = self._moment.now_ns, self._gate
        if not order.own and (reason := gate.readiness(now_ns=now_ns, owner=order.command.owner)):
            raise UserError(reason)
        self._locate()
        elapsed_ns = now_ns - self._motion.began_ns if self._motion else 0
        if order.rest:
            plan = self._tilter.plan_hold(elapsed_ns=elapsed_ns)
        else:
            plan = self._tilter.plan(order.command, elapsed_ns=elapsed_ns, rate_rad_s=order.rate_rad_s)
        trajectory, reading = plan.motion.trajectory, self._moment.reading
        where = self._where(now_ns)
        if reason := gate.check(trajectory, now_ns=now_ns, reading=reading, commanded=where, own_order=order.own):
            raise UserError(reason)
        return plan

    def _locate(self) -> None:
        """Finds out, before the first motion and after a halt, at which tilt the arm rests."""
        if self._tilter.located:
            return
        if (reading := self._moment.reading) is None:
            raise UserError(self._driver.fault() or "The arm does not report its joints: check its power and cable.")
        if not float(np.abs(reading.velocity_rad_s).max()) <= _REST_RAD_S:
            raise UserError("The arm moves by itself: wait until it rests, then command it again.")
        self._tilter.locate(reading.position_rad)

    def begin_waiting(self) -> None:
        """Begins what waits, planned from where the arm is by now, or says to its session that it never will."""
        order, self._waiting = self._waiting, None
        if order is None:
            return
        try:
            self._begin(order, self._planned(order), why=REPLACED)
        except UserError as refused:
            self._never(order, str(refused))

    def _begin(self, order: Order, plan: Plan, *, why: str) -> None:
        """Begins a motion; one under way ends, for the reason `why`."""
        now_ns = self._moment.now_ns
        if self._motion is not None:
            self._report(self._motion, end_ns=now_ns, fault=why, passing=order.passing)
        end_ns = now_ns + plan.motion.trajectory.duration_ns
        self._motion = Motion(order=order, plan=plan, began_ns=now_ns, end_ns=end_ns)
        self._tilter.begin(plan)
        self._driver.start(plan.motion.trajectory, now_ns=now_ns)
        self._report(self._motion)

    def revoke(self) -> None:
        """Brings the motion to rest of a session that has lost the arm since, or disarmed."""
        motion = self._motion
        if motion is not None and not motion.order.own and (reason := self._gate.revoked(motion.order.command.owner)):
            self.hold(reason)

    def hold(self, reason: str, *, passing: bool = False) -> None:
        """Brings a commanded motion to rest smoothly."""
        if self._motion is None or self._motion.order.own:
            return
        self._announce.once(reason)
        order = Order(rest=True, own=True, passing=passing)
        try:
            self._begin(order, self._planned(order), why=reason)
        except UserError as refused:
            self.halt(str(refused))

    def level(self, reason: str) -> None:
        """Brings the plate back to level slowly; what may not be is said, and tried again after a while."""
        now_ns, tried_ns = self._moment.now_ns, self._levelled_ns
        if self._motion is not None or (tried_ns is not None and now_ns - tried_ns < _AGAIN_NS):
            return
        self._levelled_ns = now_ns
        rate = math.radians(self._settings.gate.level_rate_deg_s)
        order = Order(rate_rad_s=rate, own=True)
        try:
            self._locate()
            if self._tilter.state(0).angle_rad >= _LEVEL_RAD:
                self._announce.once(reason)
                self._begin(order, self._planned(order), why=reason)
        except UserError as refused:
            self._announce.once(f"{reason}: {refused}")

    def watched(self) -> None:
        """Notes that nothing needs to be levelled, so that the next order to level is tried at once."""
        self._levelled_ns = None

    def halt(self, reason: str) -> None:
        """Stops the motion under way at once and says why; what has not begun never will.

        How the arm brakes is its own affair, so that from now on no plan says where it stands.
        """
        motion, self._motion = self._motion, None
        self._tilter.forget()
        if motion is not None:
            self._driver.halt(now_ns=self._moment.now_ns)
            self._report(motion, end_ns=self._moment.now_ns, fault=reason)
            self._announce.log(ERROR, f"motion stopped: {reason}")
        order, self._waiting = self._waiting, None
        if order is not None:
            self._never(order, reason)

    def finish(self) -> None:
        """Ends the motion once the arm has arrived and rests, or says that it has not."""
        motion, reading = self._motion, self._moment.reading
        if motion is None or self._moment.now_ns < motion.end_ns or reading is None:
            return
        gate = self._settings.gate
        away = float(np.abs(reading.position_rad - motion.plan.motion.trajectory.position_rad[-1]).max())
        speed = float(np.abs(reading.velocity_rad_s).max())
        arrived = away <= math.radians(gate.settle_tolerance_deg) and speed <= _REST_RAD_S
        if arrived and reading.stamp_ns >= motion.end_ns:
            self._motion = None
            self._tilter.arrive()
            self._report(motion, end_ns=self._moment.now_ns)
        elif self._moment.now_ns - motion.end_ns > gate.settle_timeout_s * 1e9:
            self.halt(f"the arm did not come to rest: {math.degrees(away):.2f} degrees from its goal")

    def commanded(self) -> Array | None:
        """Returns the joint angles (n,) that were commanded for the moment of the reading; None when nothing moves."""
        reading, now_ns = self._moment.reading, self._moment.now_ns
        return None if reading is None else self._where(min(reading.stamp_ns, now_ns))

    def _where(self, moment_ns: int) -> Array | None:
        """Returns where the joints should be at a moment, (n,), rad; None when nothing moves."""
        motion = self._motion
        return None if motion is None else motion.plan.motion.trajectory.at(moment_ns - motion.began_ns)[0]

    @property
    def under_way(self) -> bool:
        """True while a motion is under way."""
        return self._motion is not None

    def _never(self, order: Order, reason: str) -> None:
        """Says to the session that waits for it that its order ends before it has begun."""
        now_ns, lost = self._moment.now_ns, self._gate.beat_lost()
        self._announce.motion(order.command, began_ns=now_ns, end_ns=now_ns, fault=reason, passing=lost)

    def _report(self, motion: Motion, *, end_ns: int = 0, fault: str = "", passing: bool = False) -> None:
        command = motion.order.command
        self._announce.motion(command, began_ns=motion.began_ns, end_ns=end_ns, fault=fault, passing=passing)
