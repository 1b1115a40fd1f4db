"""The safety gate: it stands before every driver and decides what may move, and when the arm must hold or level.

A pure object without clock or I/O: it is told the time, the heartbeats, the stops and what the arm measured, and it
answers. It is read-only until the station's heartbeat asks for arming and the rig allows it. An emergency stop stays
in force until the next session arms the arm: the one that it came upon goes on beating, and lifts nothing by that.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from shared.messages import Heartbeat, LeaseRequest
from station.arm.drivers import JointReading
from station.arm.lease import FUTURE_NS, Lease
from station.arm.limits import trajectory_fault
from station.arm.remembered import Remembered
from station.arm.tilt_path import TiltStage
from station.arm.trajectory import JointTrajectory
from station.rig.arm_settings import GateSettings

Array = NDArray[np.float64]


class Action(Enum):
    """The gate's order to the arm: none, halt at once, come to rest smoothly and hold, or level slowly."""

    NONE = "none"
    HALT = "halt"
    HOLD = "hold"
    LEVEL = "level"


@dataclass(frozen=True, slots=True)
class Verdict:
    """The gate's order at one moment, and its reason."""

    action: Action
    reason: str = ""


_GO = Verdict(Action.NONE)


class SafetyGate:
    """Decides about every motion of one arm; `may_arm` is the rig's own permission."""

    def __init__(
        self,
        stage: TiltStage,
        *,
        settings: GateSettings,
        may_arm: bool,
        stopped: str = "",
        claimed_by: str | None = None,
    ) -> None:
        """`stopped` is the reason of an emergency stop that is in force already; `claimed_by` has claimed the arm."""
        self._stage = stage
        self._settings = settings
        self._may_arm = may_arm
        self._follow_rad = math.radians(settings.follow_tolerance_deg)
        self._follow_rad2 = self._follow_rad**2
        self._found_right = Remembered[tuple[bytes, ...], bool]()
        """The numbers of motions found right, the oldest first."""
        self._now_ns = 0
        self._lease = Lease(timeout_s=settings.heartbeat_timeout_s, claimed_by=claimed_by)
        self._armed = False
        self._stopped = stopped
        self._acknowledged: str | None = None
        """The session that has claimed the arm, or disarmed, since the stop."""
        self._stamp_ns = -1
        self._fresh_ns = 0
        self._off_since_ns: int | None = None

    @property
    def armed(self) -> bool:
        """True if the station asked for motion, the rig allows it, and no stop is in force."""
        return self._armed and self._may_arm and not self._stopped

    # --- what happens -------------------------------------------------------------------------------------------------

    def heartbeat(self, message: Heartbeat, *, now_ns: int) -> None:
        """Takes the station's sign of life, which counts by its own stamp: one that was held up proves nothing.

        Only the session that has the arm is heard.
        """
        self._see(now_ns)
        if not self._lease.heartbeat(message, now_ns=self._now_ns):
            return
        self._armed = message.armed
        if not message.armed:
            self._acknowledged = message.owner
        elif self._acknowledged == message.owner:
            self._stopped = ""  # a plate that was stopped stands still until somebody asks for motion again

    def claim(self, request: LeaseRequest, *, now_ns: int) -> str:
        """Gives the arm to a session, or returns in one sentence why not; only heartbeats arm it."""
        self._see(now_ns)
        before = self._lease.owner
        refused = self._lease.claim(request, now_ns=self._now_ns)
        self._armed = self._armed and self._lease.owner == before
        if not refused:
            self._acknowledged = request.owner
        return refused

    @property
    def owner(self) -> str | None:
        """The session that has the arm; None while nobody has it."""
        return self._lease.owner

    @property
    def claimed_by(self) -> str | None:
        """The session that claimed the arm last; None while none has."""
        return self._lease.claimed_by

    @property
    def stopped(self) -> str:
        """The reason of the emergency stop in force; empty while none is."""
        return self._stopped

    def stop(self, reason: str, *, now_ns: int) -> None:
        """Puts an emergency stop in force, until a session arms the arm that has claimed it, or disarmed, since."""
        self._see(now_ns)
        self._stopped, self._acknowledged = reason or "no reason given", None

    # --- what is allowed ----------------------------------------------------------------------------------------------

    def readiness(self, *, now_ns: int, owner: str | None = None) -> str:
        """Returns the reason why no command (of that session) may move the arm now, in one sentence.

        It is empty when one may.
        """
        late = now_ns < self._now_ns
        self._see(now_ns)
        if late:
            return "The arm's clock stepped back: motion waits until it has caught up."
        if self._stopped:
            return f"The arm is stopped ({self._stopped}): disarm and arm it again to go on."
        if not self._may_arm:
            return "The arm is read-only: set armed = true in the [arm] table of rig.toml to let it move."
        refused = "" if owner is None else self._lease.refusal(owner, now_ns=self._now_ns)
        return refused or self._unarmed()

    def _unarmed(self) -> str:
        if self.beat_lost():
            return "The arm hears no heartbeat of the station: it moves only while `station run` is alive."
        return "" if self._armed else "The arm is not armed: the station's heartbeat does not ask for it."

    def revoked(self, owner: str) -> str:
        """Returns why a motion of that session may not go on; empty while it has the arm and asks for arming."""
        if self._lease.owner not in (None, owner):
            return f"session {self._lease.owner} has taken the arm over from session {owner}"
        return "" if self._armed else "the session has disarmed the arm"

    def check(
        self,
        trajectory: JointTrajectory,
        *,
        now_ns: int,
        reading: JointReading | None,
        commanded: Array | None = None,
        own_order: bool = False,
    ) -> str:
        """Returns the reason why this trajectory may not start now; empty when it may.

        `commanded` (n,) is where the joints should be now, rad, or None at rest: what is under way goes on from there,
        and `watch` sees whether the arm follows.

        Holding and levelling after a lost heartbeat are the gate's own orders: they need no arming, and obey all
        other rules.
        """
        if not own_order and (reason := self.readiness(now_ns=now_ns)):
            return reason
        if own_order and self._stopped:
            return f"The arm is stopped ({self._stopped}): disarm and arm it again to go on."
        if fault := self._trajectory_fault(trajectory):
            return f"The motion is refused: {fault}."
        return self._start_fault(trajectory, reading, commanded)

    def _trajectory_fault(self, trajectory: JointTrajectory) -> str:
        """Returns the fault of `trajectory_fault`; a motion with the very numbers of one that was found right is right.

        The steps of a session are the same in each run, and looking at one takes as long as planning it.
        """
        parts = (trajectory.times_ns, trajectory.position_rad, trajectory.velocity_rad_s)
        numbers = *(part.tobytes() for part in parts), repr([(part.shape, part.dtype.str) for part in parts]).encode()
        if self._found_right.get(numbers):
            return ""
        fault = trajectory_fault(trajectory, stage=self._stage, settings=self._settings)
        if not fault:
            self._found_right.put(numbers, True)
        return fault

    def _start_fault(self, trajectory: JointTrajectory, reading: JointReading | None, commanded: Array | None) -> str:
        if reading is None or self._silent():
            return "The arm does not report its joints: check its power, cable and driver."
        away = np.abs(trajectory.position_rad[0] - (reading.position_rad if commanded is None else commanded))
        joint = int(np.argmax(np.nan_to_num(away, nan=np.inf)))
        if not away[joint] <= math.radians(self._settings.start_tolerance_deg):
            return (
                f"The motion is refused: {self._stage.model.joints[joint].name} is {math.degrees(away[joint]):.1f} "
                f"degrees from where the motion begins (at most {self._settings.start_tolerance_deg:.1f})."
            )
        return ""

    # --- what must be -------------------------------------------------------------------------------------------------

    def watch(self, *, now_ns: int, reading: JointReading | None, commanded: Array | None) -> Verdict:
        """Gives the order of this moment. `commanded` (n,) is where the joints should have been at the reading's stamp.

        `commanded` is None while nothing is commanded; then silence and pose are of no concern.
        """
        late = now_ns < self._now_ns
        self._see(now_ns)
        if reading is not None and reading.stamp_ns > self._stamp_ns:
            self._stamp_ns, self._fresh_ns = reading.stamp_ns, self._now_ns
        if self._stopped:
            return Verdict(Action.HALT, self._stopped)
        if late and now_ns < self._now_ns - FUTURE_NS:
            return Verdict(Action.HALT, "the arm's clock stepped back")
        if commanded is not None and (fault := self._following_fault(reading, commanded)):
            return Verdict(Action.HALT, fault)
        if commanded is None:
            self._off_since_ns = None
        return self._station_verdict()

    def _station_verdict(self) -> Verdict:
        timeout_ns, watched_ns = self._settings.heartbeat_timeout_s * 1e9, self._lease.watched_ns
        if watched_ns is None or self._now_ns - watched_ns <= timeout_ns:
            return _GO
        why = "the station's heartbeat is lost" if self.beat_lost() else "the arm is disarmed"
        if self._now_ns - watched_ns > timeout_ns + self._settings.level_after_s * 1e9:
            return Verdict(Action.LEVEL, f"{why}: levelling slowly")
        return Verdict(Action.HOLD, f"{why}: holding")

    def _following_fault(self, reading: JointReading | None, commanded: Array) -> str:
        if reading is None or self._silent():
            return "the arm no longer reports its joints"
        if reading.position_rad.shape != commanded.shape:
            return f"the arm reports {len(reading.position_rad)} joints, expected {len(commanded)}"
        away = reading.position_rad - commanded
        # The root of the sum of squares is quicker than the largest and never less; a NaN passes neither test.
        if away.dot(away) <= self._follow_rad2 or (away := np.abs(away)).max() <= self._follow_rad:
            self._off_since_ns = None
            return ""
        if self._off_since_ns is None:
            self._off_since_ns = self._now_ns
        if self._now_ns - self._off_since_ns < self._settings.follow_timeout_s * 1e9:
            return ""
        joint = int(away.argmax())
        return (
            f"{self._stage.model.joints[joint].name} is {math.degrees(away[joint]):.1f} degrees from where it should be"
        )

    def _see(self, now_ns: int) -> None:
        self._now_ns = max(self._now_ns, now_ns)

    def _silent(self) -> bool:
        return self._stamp_ns < 0 or self._now_ns - self._fresh_ns > self._settings.silence_timeout_s * 1e9

    def beat_lost(self) -> bool:
        """Returns true while no session gives a sign of life."""
        return self._lease.lost(now_ns=self._now_ns)
