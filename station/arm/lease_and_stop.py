"""The lease and the emergency stop on the bus: who may have the arm, and what outlives the agent."""

from __future__ import annotations

from shared.bus import Bus
from shared.messages import ArmLease, ArmReply, Heartbeat, LeaseRequest, Message
from station.arm.announcements import ERROR, WARNING, Announcements, Moment
from station.arm.gate import SafetyGate
from station.arm.kept import Kept

_LEASE_NS = 1_000_000_000


class LeaseAndStop:
    """Takes claims, heartbeats and stops to the gate, and tells what has come of them."""

    def __init__(
        self, bus: Bus, moment: Moment, *, gate: SafetyGate, announce: Announcements, kept: Kept | None
    ) -> None:
        self._bus, self._moment = bus, moment
        self._gate, self._announce, self._kept = gate, announce, kept
        self._told, self._told_ns, self._unkept = ("", ""), 0, ""

    def heartbeat(self, message: Heartbeat) -> None:
        """Takes a session's sign of life."""
        self._gate.heartbeat(message, now_ns=self._moment.now_ns)

    def claim(self, message: Message) -> ArmReply:
        """Gives the arm to a session, or answers why not."""
        if not isinstance(message, LeaseRequest):
            return ArmReply(reason="Expected a LeaseRequest.")
        if refused := self._gate.claim(message, now_ns=self._moment.now_ns):
            self._announce.log(WARNING, f"refused to session {message.owner}: {refused}")
            return ArmReply(reason=refused, stamp_ns=self._moment.now_ns)
        return ArmReply(accepted=True, stamp_ns=self._moment.now_ns)

    def stop(self, reason: str) -> None:
        """Puts a stop in force, and keeps it before it is answered."""
        self._gate.stop(reason, now_ns=self._moment.now_ns)
        self._keep()

    def tick(self) -> None:
        """Publishes lease and stop once a second and when they change, for a session without a name and lookers-on."""
        now_ns, lease = self._moment.now_ns, (self._gate.owner or "", self._gate.stopped)
        if lease != self._told or (any(lease) and now_ns - self._told_ns >= _LEASE_NS):
            self._told, self._told_ns = lease, now_ns
            self._bus.publish("arm/lease", ArmLease(now_ns, *lease))
        self._keep()

    def _keep(self) -> None:
        """Keeps stop and claim where the next agent of this rig finds them; what cannot be is tried again."""
        unkept, self._unkept = self._unkept, ""
        try:
            if self._kept is not None:
                self._kept.stop.keep(self._gate.stopped)
                self._kept.claimed_by.keep(self._gate.claimed_by or "")
        except OSError as fault:
            self._unkept = f"the next arm agent will not know whether the arm is stopped, and who claimed it: {fault}"
            if self._unkept != unkept:
                self._announce.log(ERROR, self._unkept)
