"""Sessions that a page starts, pauses and stops, and the emergency stop of the arm."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from shared.bus import Bus
from shared.clock import Clock
from shared.errors import UserError
from shared.messages import SESSION_ACTIONS, ArmReply, ArmStop, SessionReply, SessionRequest
from shared.rig import RigConfig
from station.app import assembly
from station.app.asking import asked
from station.app.commands.rig import HELPERS
from station.app.recordings import recording_path
from station.app.serve.jobs import Program

_STOP_S, _CONTROL_S = 3.0, 2.0
_MOST_SAMPLES = 100_000


@dataclass(frozen=True, kw_only=True)
class Files:
    """The files of the rig: its rig file, the plan of its sessions (None: the paper's) and where recordings lie."""

    rig: Path
    plan: Path | None
    folder: Path


class Sessions:
    """The station's side of a page's buttons; its methods may be called on any thread."""

    def __init__(self, bus: Bus, rig: RigConfig, *, files: Files, clock: Clock) -> None:
        self._bus, self._rig, self._files, self._clock = bus, rig, files, clock
        self._lock = threading.Lock()
        self._program: Program | None = None

    def begin(self, *, samples: int, seed: int) -> None:
        """Starts a session; on a simulated rig of which nothing runs yet, twin and agents as well.

        Raises:
            UserError: if a session runs already, or the numbers are none.
        """
        if not (0 < samples <= _MOST_SAMPLES and seed >= 0):
            raise UserError(f"Expected 1 to {_MOST_SAMPLES} samples and a seed of 0 or more, got {samples} and {seed}")
        with self._lock:
            if "station" in self._bus.alive() or (self._program is not None and self._program.runs):
                raise UserError("Expected no session on this rig, but one runs; stop it first")
            out = self._files.folder / recording_path(None)
            words = [self._command(), "--rig", str(self._files.rig), "--samples", str(samples), "--seed", str(seed)]
            more = ["--plan", str(self._files.plan)] if self._files.plan else []
            more += ["--no-view"] if words[0] == "rig" else []
            out.parent.mkdir(parents=True, exist_ok=True)
            self._program = Program([*words, "--out", str(out), *more])
            self._program.begin()

    def _command(self) -> str:
        """Returns the command that a session needs: `rig` starts everybody, `run` expects them on the bus."""
        simulated = assembly.arm_settings(self._rig).driver == "simulated"
        return "rig" if simulated and not self._bus.alive() & HELPERS else "run"

    def control(self, action: str) -> None:
        """Pauses, lets go on or stops the session that runs, whoever has started it.

        Raises:
            UserError: if it does not answer or refuses.
        """
        if action not in SESSION_ACTIONS:
            raise UserError(f"Expected start, {', '.join(SESSION_ACTIONS)}, got '{action}'")
        request = SessionRequest(self._clock.now_ns(), action)
        reply = asked(self._bus, "session/control", request, within_s=_CONTROL_S)
        if isinstance(reply, SessionReply) and reply.accepted:
            return
        if action == "stop" and self._program is not None and self._program.runs:
            threading.Thread(target=self._program.end, name="stop", daemon=True).start()  # before it is on the bus
            return
        reason = reply.reason if isinstance(reply, SessionReply) else "no session answers on this rig's bus"
        raise UserError(f"Expected the session to {action}, but {reason}")

    def stop_arm(self) -> None:
        """Stops the arm where it is, at once.

        Raises:
            UserError: if the arm agent does not answer.
        """
        stop = ArmStop(self._clock.now_ns(), "emergency stop on the page")
        reply = asked(self._bus, "arm/stop", stop, within_s=_STOP_S)
        if not (isinstance(reply, ArmReply) and reply.accepted):
            raise UserError(f"The arm agent did not answer within {_STOP_S:g} s: press the red button")

    def state(self) -> dict[str, Any] | None:
        """Returns the session that this page has started, with its last lines; None if there is none."""
        return None if self._program is None else self._program.state()

    def end(self) -> None:
        """Ends the session that this page has started: the plate comes back to level first."""
        if self._program is not None:
            self._program.end()
