"""The session's side of its control over the bus: pause, go on, stop, and once a second how far it is."""

from __future__ import annotations

from shared.bus import Bus
from shared.messages import SESSION_ACTIONS, Message, SessionPause, SessionReply, SessionRequest, SessionStatus
from station.app.processes import StopRequest
from station.sampling.plan import Plan

STATUS_NS = 1_000_000_000
_REASON = "stopped by the user, over the bus"


class SessionControl:
    """Serves `session/control` and publishes `session/status`; call `tick` often, on the thread that polls the bus.

    A pause travels as a message of its own, `session/pause`, which is recorded: a replay pauses at the same run.
    """

    def __init__(self, bus: Bus, plan: Plan, *, stop: StopRequest, owner: str, recording: str) -> None:
        self._bus, self._plan, self._stop = bus, plan, stop
        self._owner, self._recording = owner, recording
        self._paused, self._started_ns = False, 0
        self._now_ns = self._due_ns = 0
        bus.serve("session/control", self._answer)

    def _answer(self, message: Message) -> SessionReply:
        action = message.action if isinstance(message, SessionRequest) else ""
        if action == "stop":
            if not self._stop.reason:  # asking twice would leave the plate where it is, as Ctrl-C twice does
                self._stop.ask(_REASON)
        elif action in ("pause", "resume"):
            self._paused, self._due_ns = action == "pause", 0
            self._bus.publish("session/pause", SessionPause(self._now_ns, self._paused))
        else:
            return SessionReply(reason=f"Expected one of {', '.join(SESSION_ACTIONS)}, got '{action}'")
        return SessionReply(accepted=True)

    def tick(self, now_ns: int, *, samples: int) -> None:
        """Publishes the status when it is due."""
        self._now_ns, self._started_ns = now_ns, self._started_ns or now_ns
        if now_ns < self._due_ns:
            return
        self._due_ns = now_ns + STATUS_NS
        slip = self._plan.slip
        status = SessionStatus(
            stamp_ns=now_ns,
            owner=self._owner,
            recording=self._recording,
            samples=samples,
            total=self._plan.samples,
            paused=self._paused,
            slip_base_px=slip.base_px,
            slip_per_deg_px=slip.per_deg_px,
            slip_corners=slip.corners,
            started_ns=self._started_ns,
        )
        self._bus.publish("session/status", status)
