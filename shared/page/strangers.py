"""Connections that have not shown the key yet: few at a time, each for a short time.

Any program of this machine can open connections and say nothing on them, each of which holds a thread and a file of
the server. A full house therefore ends its oldest stranger, not the one that comes: who has the key shows it with the
first words, long before as many others have come, and is no stranger from then on.
"""

from __future__ import annotations

import contextlib
import socket
import threading

MOST = 128
"""Strangers at a time: an eighth of the 1024 files that a process usually may open (`ulimit -n`), and many times the
six connections that a browser opens to one page."""
LONGEST_S = 5.0
"""A stranger's time, s, however much it sends meanwhile: a page of ours sends its key within milliseconds.
`pytest tests/unit/shared/test_page_strangers.py` shows what both numbers do."""


class Strangers:
    """The connections without the key, oldest first. Its methods may be called on any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._since_s: dict[socket.socket, float] = {}

    def __len__(self) -> int:
        with self._lock:
            return len(self._since_s)

    def come(self, connection: socket.socket, now_s: float) -> None:
        """Counts a new connection; ends the oldest one where there are too many."""
        with self._lock:
            self._since_s[connection] = now_s
            if len(self._since_s) > MOST:
                self._end(next(iter(self._since_s)))

    def go(self, connection: socket.socket) -> None:
        """Counts a connection no longer: it has shown the key, or is closed."""
        with self._lock:
            self._since_s.pop(connection, None)

    def end_old(self, now_s: float) -> None:
        """Ends those whose time is over."""
        with self._lock:
            for connection in [one for one, since_s in self._since_s.items() if now_s - since_s > LONGEST_S]:
                self._end(connection)

    def _end(self, connection: socket.socket) -> None:
        """Ends both directions, so that the connection's own thread reads its end and closes it."""
        del self._since_s[connection]
        with contextlib.suppress(OSError):  # the other end was quicker
            connection.shutdown(socket.SHUT_RDWR)
