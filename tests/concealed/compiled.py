"""Compiles functions and keeps what was compiled, unless any of the sources has changed.

Numba notices a change of the file that a function stands in, but not of the files of those that it calls.
"""

from __future__ import annotations

import contextlib
import hashlib
from pathlib import Path

from numba import njit

_SOURCES = ("world.py", "contact.py", "view.py", "ride.py", "replay.py", "imitate.py")
_HERE = Path(__file__).parent


def _forget_what_is_stale() -> None:
    kept = _HERE / "__pycache__"
    digest = hashlib.sha256(b"".join((_HERE / name).read_bytes() for name in _SOURCES)).hexdigest()
    stamp = kept / "compiled.sha256"
    with contextlib.suppress(OSError):  # a folder that cannot be written to keeps nothing
        if stamp.exists() and stamp.read_text(encoding="utf-8") == digest:
            return
        kept.mkdir(exist_ok=True)
        for index in kept.glob("*.nbi"):
            index.unlink(missing_ok=True)
        stamp.write_text(digest, encoding="utf-8")


_forget_what_is_stale()
compiled = njit(cache=True)
"""Decorates a function that is to be compiled."""
