"""Writes why the marker is not tracked: each reason once while the trouble lasts, and when it is over.

A tracker that sees something else in the marker's place changes its reason from frame to frame: one recording of
`make run` had 24 lines in three seconds, of two reasons in turn.
"""

from __future__ import annotations

import re

from pi_agent.diagnosis import PATIENCE_NS
from pi_agent.journal import Journal


class Trouble:
    """Takes the fault of each frame. A trouble is over once no frame has had a fault for `PATIENCE_NS`."""

    def __init__(self, journal: Journal) -> None:
        self._journal = journal
        self._reported = set[str]()
        self._clear_since_ns: int | None = None

    def see(self, fault: str, *, capture_ns: int, assumed: bool) -> None:
        """Takes a frame's fault (empty: none); `assumed` says that the marker's quarter turn is not certain."""
        if fault:
            self._clear_since_ns = None
            self._tell(fault)
        elif self._reported:
            self._clear(capture_ns, assumed=assumed)

    def _tell(self, fault: str) -> None:
        kind = re.sub(r"\d+(\.\d+)?", "#", fault)  # the sizes in a reason change with every frame
        if kind not in self._reported:
            self._reported.add(kind)
            self._journal.error(fault)

    def _clear(self, capture_ns: int, *, assumed: bool) -> None:
        if self._clear_since_ns is None:
            self._clear_since_ns = capture_ns
        elif capture_ns - self._clear_since_ns >= PATIENCE_NS:
            self._reported.clear()
            self._clear_since_ns = None
            self._journal.info(f"The marker is found again{' (which quarter turn it is is assumed)' * assumed}")
