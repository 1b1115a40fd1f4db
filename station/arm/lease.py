"""The lease of the arm: one session at a time may move it.

A session has the arm from its claim, or from its first armed heartbeat, until it disarms or is silent for too long. Any
other is refused in one sentence, unless it takes over. Once a session has claimed the arm, heartbeats give it to no
other: who had it before has lost it, and knows plate and block as they were. The lease is a pure object without a
clock: it is told the time.
"""

from __future__ import annotations

from collections import OrderedDict

from shared.messages import Heartbeat, LeaseRequest

FUTURE_NS = 200_000_000
"""A heartbeat or a reading from further ahead, or a tick from further back, tells of a clock that was set, not of a
busy machine."""
_REMEMBERED = 64
"""Sessions whose last stamp is remembered, so that a heartbeat of theirs that was held up proves nothing."""


class Lease:
    """The owner of the arm and his last sign of life; an owner without a name is a session that gave none."""

    def __init__(self, *, timeout_s: float, claimed_by: str | None = None) -> None:
        """`claimed_by` is the session that claimed the arm last, of an agent before this one."""
        self._timeout_ns = timeout_s * 1e9
        self._last_ns: OrderedDict[str, int] = OrderedDict()
        self.claimed_by = claimed_by
        """The session that claimed the arm last; None while none has."""
        self.owner: str | None = None
        """The session that has the arm; None while nobody has it."""
        self.beat_ns: int | None = None
        """The stamp of the last sign of life of whoever had the arm last."""
        self.watched_ns: int | None = None
        """The stamp of the last heartbeat of an owner that asked for arming: only such a one watches the plate."""

    def claim(self, request: LeaseRequest, *, now_ns: int) -> str:
        """Gives the arm to a session, or returns in one sentence why not."""
        if not request.take_over:
            asked = self.refusal if request.owner in self._last_ns else self._others
            if reason := asked(request.owner, now_ns=now_ns):
                return reason
        self.claimed_by = request.owner
        self._give(request.owner, stamp_ns=now_ns)
        return ""

    def heartbeat(self, message: Heartbeat, *, now_ns: int) -> bool:
        """Takes a sign of life; true if it is the owner's, or makes its sender the owner.

        It counts by its own stamp. One that is older than the time without which a session is lost shows no life: of a
        session that nobody has heard yet it would end an emergency stop, and then be missed.
        """
        oldest_ns = max(now_ns - self._timeout_ns, self._last_ns.get(message.owner, 0))
        if not oldest_ns <= message.stamp_ns <= now_ns + FUTURE_NS:
            return False
        if self.refusal(message.owner, now_ns=now_ns):
            return False
        self._give(message.owner, stamp_ns=message.stamp_ns)
        if message.armed:
            self.watched_ns = message.stamp_ns
        else:
            self.owner = None
        return True

    def refusal(self, asking: str, *, now_ns: int) -> str:
        """Returns the reason why this session may not have the arm now, in one sentence; empty if it may."""
        if reason := self._others(asking, now_ns=now_ns):
            return reason
        if self.claimed_by in (None, asking):
            return ""
        other = self.claimed_by or "without a name"
        return f"This session has lost the arm to session {other}, which claimed it later: start one anew to go on."

    def _others(self, asking: str, *, now_ns: int) -> str:
        """Returns in one sentence that another session has the arm; empty if none has."""
        if self.owner in (None, asking) or self.lost(now_ns=now_ns):
            return ""
        return (
            f"The arm belongs to another session ({self.owner or 'without a name'}): wait until that has ended, or "
            "take over with `station run --take-over`."
        )

    def lost(self, *, now_ns: int) -> bool:
        """Returns true while no session gives a sign of life."""
        return self.beat_ns is None or now_ns - self.beat_ns > self._timeout_ns

    def _give(self, owner: str, *, stamp_ns: int) -> None:
        self.owner, self.beat_ns = owner, stamp_ns
        self._last_ns[owner] = max(stamp_ns, self._last_ns.get(owner, 0))
        self._last_ns.move_to_end(owner)
        if len(self._last_ns) > _REMEMBERED:
            self._last_ns.popitem(last=False)
