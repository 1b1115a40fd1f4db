"""Compiles functions and keeps what was compiled, unless any of the sources has changed.

Numba notices a change of the file that a function stands in, but not of the files of those that it calls.
"""

from __future__ import annotations

import contextlib
import hashlib
import sys
from collections.abc import Generator
from pathlib import Path
from typing import TextIO

from numba import njit

_SOURCES = ("world.py", "contact.py", "view.py", "ride.py", "replay.py", "imitate.py")
_HERE = Path(__file__).parent
_KEPT = _HERE / "__pycache__"


def _forget_what_is_stale() -> None:
    digest = hashlib.sha256(b"".join((_HERE / name).read_bytes() for name in _SOURCES)).hexdigest()
    stamp = _KEPT / "compiled.sha256"
    with contextlib.suppress(OSError):  # a folder that cannot be written to keeps nothing
        if stamp.exists() and stamp.read_text(encoding="utf-8") == digest:
            return
        _KEPT.mkdir(exist_ok=True)
        for index in _KEPT.glob("*.nbi"):
            index.unlink(missing_ok=True)
        stamp.write_text(digest, encoding="utf-8")


_forget_what_is_stale()
compiled = njit(cache=True)
"""Decorates a function that is to be compiled."""


@contextlib.contextmanager
def one_process_compiles() -> Generator[None]:
    """Whoever calls a compiled function in here is alone among the processes that do so in this checkout.

    Compiling a run of the rig takes ten seconds. Processes that begin together would each compile it; so the first one
    does, and the others load what it has kept. Where nothing can be kept or locked, they compile as before.
    """
    with contextlib.ExitStack() as held:
        with contextlib.suppress(OSError):
            _KEPT.mkdir(exist_ok=True)
            _wait_for(held.enter_context((_KEPT / "compiled.lock").open("a")))
        yield


def _wait_for(file: TextIO) -> None:
    """Locks the file as soon as nobody else does; on Windows the tests of the generator do not run."""
    if sys.platform != "win32":
        import fcntl  # noqa: PLC0415  # not on Windows

        fcntl.flock(file, fcntl.LOCK_EX)
