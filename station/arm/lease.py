"""The lease of the arm: one session at a time may move it.

A session has the arm from its claim, or from its first armed heartbeat, until it disarms or is silent for too long. Any
other is refused in one sentence, unless it takes over; so is one that has lost the arm to another: what it knows of
plate and block is of before. The lease is a pure object without a clock: it is told the time.
"""

from __future__ import annotations

from collections import OrderedDict
from typing import Any

from shared.messages import Heartbeat, LeaseRequest

_FUTURE_NS = 200_000_000  # a heartbeat from further ahead is a wrong clock, not a live station
_REMEMBERED = 64
"""Sessions that are remembered: by their last stamp, so that a heartbeat of theirs that was held up proves nothing, and
by who has the arm in their place."""


class Lease:
    """The owner of the arm and his last sign of life; an owner without a name is a session that gave none."""

    def __init__(self, *, timeout_s: float) -> None:
        self._timeout_ns = timeout_s * 1e9
        self._last_ns: OrderedDict[str, int] = OrderedDict()
        self._lost_to: OrderedDict[str, str] = OrderedDict()
        self.owner: str | None = None
        """The session that has the arm; None while nobody has it."""
        self.beat_ns: int | None = None
        """The stamp of the last sign of life of whoever had the arm last."""
        self.watched_ns: int | None = None
        """The stamp of the last heartbeat of an owner that asked for arming: only such a one watches the plate."""

    def claim(self, request: LeaseRequest, *, now_ns: int) -> str:
        """Gives the arm to a session, or returns in one sentence why not."""
        if not request.take_over and (reason := self.refusal(request.owner, now_ns=now_ns)):
            return reason
        self._give(request.owner, stamp_ns=now_ns)
        return ""

    def heartbeat(self, message: Heartbeat, *, now_ns: int) -> bool:
        """Takes a sign of life; true if it is the owner's, or makes its sender the owner.

        It counts by its own stamp. One that is older than the time without which a session is lost shows no life: of a
        session that nobody has heard yet it would end an emergency stop, and then be missed.
        """
        oldest_ns = max(now_ns - self._timeout_ns, self._last_ns.get(message.owner, 0))
        if not oldest_ns <= message.stamp_ns <= now_ns + _FUTURE_NS:
            return False
        if self.refusal(message.owner, now_ns=now_ns):
            return False
        self._give(message.owner, stamp_ns=message.stamp_ns, to_move=message.armed)
        if message.armed:
            self.watched_ns = message.stamp_ns
        else:
            self.owner = None
        return True

    def refusal(self, asking: str, *, now_ns: int) -> str:
        """Returns the reason why this session may not have the arm now, in one sentence; empty if it may."""
        if asking == self.owner:
            return ""
        if self.owner is None or self.lost(now_ns=now_ns):
            return self._lost_by(asking)
        return (
            f"The arm belongs to another session ({self.owner or 'without a name'}): wait until that has ended, or "
            "take over with `station run --take-over`."
        )

    def _lost_by(self, asking: str) -> str:
        other = self._lost_to.get(asking)
        return f"This session has lost the arm to session {other}: start one anew to go on." if other else ""

    def lost(self, *, now_ns: int) -> bool:
        """Returns true while no session gives a sign of life."""
        return self.beat_ns is None or now_ns - self.beat_ns > self._timeout_ns

    def _give(self, owner: str, *, stamp_ns: int, to_move: bool = True) -> None:
        if to_move and self.owner and self.owner != owner:
            _remember(self._lost_to, self.owner, owner)
        self._lost_to.pop(owner, None)
        self.owner, self.beat_ns = owner, stamp_ns
        _remember(self._last_ns, owner, max(stamp_ns, self._last_ns.get(owner, 0)))


def _remember(of: OrderedDict[str, Any], session: str, what: Any) -> None:
    """Remembers something of a session, and forgets the one that was heard least recently."""
    of[session] = what
    of.move_to_end(session)
    if len(of) > _REMEMBERED:
        of.popitem(last=False)
