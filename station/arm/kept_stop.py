"""The emergency stop in force, kept on disk: it outlives the arm agent that was asked for it, and a power cut.

A stop ends with the next session that arms the arm, and with nothing else. The session that it came upon may not know
of it, for it may be stopped itself, or cut off; an agent that is killed and started again would obey its heartbeats.
"""

from __future__ import annotations

import os
from pathlib import Path

from shared.errors import UserError
from shared.system.files import write_through


class KeptStop:
    """One file, which is there while a stop is in force, and says why."""

    def __init__(self, path: Path) -> None:
        """`path` is the file; its folder is made with the first stop."""
        self._path = path
        self._reason = ""

    def read(self) -> str:
        """Returns the reason of the stop that an agent before this one has left in force; empty if there is none.

        Raises:
            UserError: if it cannot be found out, as the arm may then not move.
        """
        try:
            self._reason = self._path.read_text(encoding="utf-8", errors="replace") or "emergency stop"
        except FileNotFoundError:
            self._reason = ""
        except OSError as unreadable:
            raise UserError(
                f"Expected to read whether an emergency stop is in force from {self._path}, got: {unreadable}; make it "
                "readable, or set XDG_STATE_HOME to a folder that is"
            ) from unreadable
        return self._reason

    def keep(self, reason: str) -> None:
        """Keeps the stop that is in force, or that none is (an empty reason); a change alone is written.

        A stop is on the disk itself before this returns. That there is none is not waited for: a power cut may then
        bring a stop back, which the next session lifts.

        Raises:
            OSError: if it cannot be written; the next call tries again.
        """
        if reason == self._reason:
            return
        if reason:
            write_through(self._path, reason)
        else:
            self._path.unlink(missing_ok=True)
        self._reason = reason


def kept_stop(rig_id: str) -> KeptStop:
    """Returns where the stop of a rig is kept on this computer: the folder of programs' state, by its usual name."""
    state = os.environ.get("XDG_STATE_HOME") or Path("~/.local/state").expanduser()
    return KeptStop(Path(state) / "repose" / f"{rig_id}.stopped")
