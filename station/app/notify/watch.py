"""Watches a session on the bus and says what somebody should know: faults, a lost mark, long outages, the end."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from shared.bus import Bus, Received
from shared.messages import MarkerCorners, RunEvent
from shared.notify import Kind, NotifyConfig
from station.app.notify.notifier import Notifier


class Watchable(Protocol):
    """A session's state machine, as far as it is asked here."""

    @property
    def phase(self) -> str:
        """The current phase."""
        ...

    @property
    def outage(self) -> str:
        """The network's fault that the session waits out; empty if it does not."""
        ...

    @property
    def samples(self) -> int:
        """The number of runs that have given a sample."""
        ...


class Watch:
    """Follows one session. `attach` it, call `tick` often, and `ended` when the recording is closed."""

    def __init__(
        self,
        notifier: Notifier,
        config: NotifyConfig,
        *,
        rig_id: str,
        recording: str,
        planned: int,
        now: Callable[[], int],
    ) -> None:
        """`recording` is the file's name, `planned` the number of runs, `now` the station's clock (ns)."""
        self._notifier, self._config, self._now = notifier, config, now
        self._who = f"Rig {rig_id}"
        self._facts = {"rig": rig_id, "recording": recording, "planned": planned}
        self._machine: Watchable | None = None
        self._on_failure: Callable[[str], None] = lambda _: None
        self._waiting_ns = now()
        self._lost_ns = 0
        """The receipt of the first frame without the mark, since it was seen last."""
        self._mark_notified = self._outage_notified = self._over = False

    def attach(self, bus: Bus, machine: Watchable, *, on_failure: Callable[[str], None]) -> None:
        """Listens to the session; `on_failure` gets a sentence, within `tick`, when somebody could not be told."""
        self._machine, self._on_failure = machine, on_failure
        bus.subscribe("camera/corners", self._on_corners)
        bus.subscribe("session/event", self._on_event)

    def stopped_recording(self, reason: str) -> None:
        """Tells that the recording had to stop; called on the recorder's thread."""
        self._tell("disk", f"{self._who}: {reason}")

    def ended(self, fault: str, *, samples: int) -> None:
        """Tells that the session is over; a user who is told of faults alone is told of an end by a fault."""
        kinds = {"end", "fault"} if fault else {"end"}
        outcome = f"the session ended early: {fault}" if fault else "the session is over"
        text = f"{self._who}: {outcome} ({samples} of {self._facts['planned']} samples, {self._facts['recording']})"
        self._over = True
        self._tell("end", text, wanted=bool(kinds & set(self._config.on)), samples=samples, fault=fault)

    def broke_off(self, error: Exception) -> None:
        """Tells that an error has ended the session that is watched, in place of its plan."""
        if self._machine is not None and not self._over:
            self.ended(f"the program met an error ({type(error).__name__})", samples=self._machine.samples)

    def tick(self, now_ns: int) -> None:
        """Tells of an outage that has lasted too long, and reports failures."""
        for failure in self._notifier.failures():
            self._on_failure(failure)
        machine = self._machine
        if machine is None or not machine.outage:
            self._waiting_ns, self._outage_notified = now_ns, False
            return
        waited_s = (now_ns - self._waiting_ns) * 1e-9
        if waited_s > self._config.outage_s and not self._outage_notified:
            self._outage_notified = True
            self._tell("outage", f"{self._who}: the session has waited for {waited_s:.0f} s; {machine.outage}")

    def _on_event(self, received: Received) -> None:
        """Tells of a run that a fault ended; what ended the session, or is waited out, is told elsewhere."""
        event, machine = received.message, self._machine
        if not isinstance(event, RunEvent) or event.phase != "ABORTED" or machine is None:
            return
        if machine.phase != "FINISHED" and not machine.outage:
            self._tell("fault", f"{self._who}: run {event.run} failed: {event.reason}", run=event.run)

    def _on_corners(self, received: Received) -> None:
        corners = received.message
        if not isinstance(corners, MarkerCorners):
            return
        if corners.found:
            self._lost_ns, self._mark_notified = 0, False
            return
        self._lost_ns = self._lost_ns or received.receive_ns
        lost_s = (received.receive_ns - self._lost_ns) * 1e-9
        if lost_s > self._config.mark_s and not self._mark_notified:
            self._mark_notified = True
            why = f" ({corners.reason})" if corners.reason else ""
            self._tell("mark", f"{self._who}: the camera has not seen the mark for {lost_s:.0f} s{why}")

    def _tell(self, kind: Kind, text: str, *, wanted: bool | None = None, **facts: Any) -> None:
        samples = self._machine.samples if self._machine is not None else 0
        said = {"samples": samples, "fault": "", **self._facts, **facts}
        self._notifier.tell(kind, text, time_ns=self._now(), wanted=wanted, **said)
