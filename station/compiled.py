"""Compiles numerical functions, and caches the machine code where that is possible.

A function's machine code has in it the constants and the functions of other files that it uses, and numba itself looks
at the function's own file only: after an update of another file it would go on with the old ones. So nothing is kept
for longer than all sources of a folder stay as they are.
"""

from __future__ import annotations

import functools
import hashlib
import os
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numba
import numba.core.config
from numba.misc.appdirs import AppDirs

SETTINGS: Any = numba.core.config
"""Numba reads its environment into this module as it is imported, so its names are not declared."""

STAMP = "compiled.sha256"
"""The file beside the machine code that says of which sources it is."""


def compiled(function: Callable[..., Any]) -> Any:
    """Returns the function, compiled by numba when it is first called.

    Machine code is kept beside the source, else in the user's cache. Where neither can be written (a read-only home)
    numba refuses; then each process compiles anew, which takes seconds and changes no number.

    A division by zero gives inf or nan, as in NumPy. Python's exception would cost a branch at each division, which
    keeps loops from being vectorised: the law of breakaways took 1.85 times as long, for the same bits.
    """
    try:
        with _kept_for(Path(function.__code__.co_filename).parent):
            return numba.njit(cache=True, error_model="numpy")(function)
    except RuntimeError:
        return numba.njit(error_model="numpy")(function)


@contextmanager
def _kept_for(folder: Path) -> Generator[None]:
    """Has numba keep what is decorated inside for as long as the folder's sources stay as they are.

    Beside the source what is stale is deleted. A cache that other versions may use has a part for these sources.
    """
    asked, digest = SETTINGS.CACHE_DIR, _digest(folder)
    if asked or not _cleared(folder / "__pycache__", digest):
        cache = asked or AppDirs(appname="numba", appauthor=False).user_cache_dir
        SETTINGS.CACHE_DIR = str(Path(cache) / digest)
    try:
        yield
    finally:
        SETTINGS.CACHE_DIR = asked


@functools.cache
def _cleared(kept: Path, digest: str) -> bool:
    """Deletes the machine code of other sources; False where nothing can be written."""
    with suppress(OSError):
        kept.mkdir(exist_ok=True)
        if not (kept / STAMP).exists() or (kept / STAMP).read_text(encoding="utf-8") != digest:
            for index in kept.glob("*.nbi"):
                index.unlink(missing_ok=True)
            (kept / STAMP).write_text(digest, encoding="utf-8")
        return os.access(kept, os.W_OK)
    return False


@functools.cache
def _digest(folder: Path) -> str:
    """Returns a short hash of the sources in a folder: paths must stay short on Windows."""
    total = hashlib.sha256()
    for source in sorted(folder.glob("*.py")):
        total.update(source.read_bytes())
    return total.hexdigest()[:8]
