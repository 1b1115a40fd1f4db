"""Busy processes that end with the one that started them, however that ends."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from collections.abc import Generator

BUSY = "import os, sys\nwhile os.getppid() == int(sys.argv[1]):\n    sum(range(100_000))"


@contextlib.contextmanager
def load(count: int) -> Generator[list[int]]:
    """Starts `count` processes that compute for nothing, and yields their process ids.

    They have a session of their own, so that Ctrl-C reaches only the process that ends them.
    """
    words = [sys.executable, "-c", BUSY, str(os.getpid())]
    children = [subprocess.Popen(words, start_new_session=True) for _ in range(count)]
    try:
        yield [child.pid for child in children]
    finally:
        for child in children:
            child.kill()
        for child in children:
            child.wait()
