"""Texts that outlive the arm agent, and a power cut: the emergency stop in force, and who claimed the arm last.

A stop ends with the next session that arms the arm, and with nothing else. The session that it came upon may not know
of it, for it may be stopped itself, or cut off; an agent that is killed and started again would obey its heartbeats. So
may a session not know that another one has claimed the arm since.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from shared.errors import UserError
from shared.system.files import write_through


class KeptText:
    """One file, which is there while there is something to keep, and says it."""

    def __init__(self, path: Path, *, what: str, cut_off: str) -> None:
        """`path` is the file, whose folder is made with the first text.

        `what` is to be found out from it, in words, and `cut_off` is what an empty file says.
        """
        self._path, self._what, self._cut_off = path, what, cut_off
        self._text = ""

    def read(self) -> str:
        """Returns what an agent before this one has kept; empty if that is nothing.

        Raises:
            UserError: if it cannot be found out, as the arm may then not move.
        """
        try:
            self._text = self._path.read_text(encoding="utf-8", errors="replace") or self._cut_off
        except FileNotFoundError:
            self._text = ""
        except OSError as unreadable:
            raise UserError(
                f"Expected to read {self._what} from {self._path}, got: {unreadable}; make it readable, or set "
                "XDG_STATE_HOME to a folder that is"
            ) from unreadable
        return self._text

    def keep(self, text: str) -> None:
        """Keeps a text, or that there is none (an empty one); a change alone is written.

        A text is on the disk itself before this returns. That there is none is not waited for: a power cut may then
        bring a stop back, which the next session lifts.

        Raises:
            OSError: if it cannot be written; the next call tries again.
        """
        if text == self._text:
            return
        if text:
            write_through(self._path, text)
        else:
            self._path.unlink(missing_ok=True)
        self._text = text


@dataclass(frozen=True, slots=True)
class Kept:
    """The emergency stop in force, and the session that claimed the arm last."""

    stop: KeptText
    claimed_by: KeptText

    @classmethod
    def at(cls, path: Path) -> Kept:
        """Returns both beside each other: `path` with an ending for each."""
        return cls(
            stop=KeptText(
                path.with_name(f"{path.name}.stopped"),
                what="whether an emergency stop is in force",
                cut_off="emergency stop",
            ),
            claimed_by=KeptText(
                path.with_name(f"{path.name}.claimed"), what="which session has claimed the arm", cut_off=""
            ),
        )


def kept(rig_id: str) -> Kept:
    """Returns what is kept of a rig on this computer: in the folder of programs' state, by its usual name."""
    state = os.environ.get("XDG_STATE_HOME") or Path("~/.local/state").expanduser()
    return Kept.at(Path(state) / "repose" / rig_id)
