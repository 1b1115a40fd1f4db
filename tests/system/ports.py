"""Ports for processes that do not listen on them yet: never the same twice, also not for two workers side by side.

They lie below those that the system gives to outgoing connections, so that nothing else takes one in between.
"""

from __future__ import annotations

import itertools
import os
import socket

FIRST, OF_A_WORKER = 20_000, 1_500
_ASIDE = int(os.environ.get("REPOSE_PORTS_ASIDE", "0"))
"""The workers of another run of pytest, side by side with this one, that have ports of their own (see Makefile)."""
_WORKER = (_ASIDE + int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))) % 8
# Tests that follow each other begin elsewhere: a port may be held for a minute after its use.
_tried = itertools.count(os.getpid() * 50)


def free_port() -> int:
    """A TCP port of 127.0.0.1 on which nobody listens."""
    for number in itertools.islice(_tried, OF_A_WORKER):
        port = FIRST + _WORKER * OF_A_WORKER + number % OF_A_WORKER
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port
    raise RuntimeError("every port of this worker is taken")
