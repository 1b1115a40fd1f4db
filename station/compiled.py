"""Compiles numerical functions, and caches the machine code where that is possible."""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numba
import numba.core.config

SETTINGS: Any = numba.core.config
"""Numba reads its environment into this module as it is imported, so its names are not declared."""


def compiled(function: Callable[..., Any]) -> Any:
    """The function, compiled by numba when it is first called.

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
    """Has numba keep what is decorated inside in a folder that is another one whenever a source beside it changes.

    A function's machine code has in it the constants and the functions of other files that it uses, and numba itself
    looks at the function's own file only: after an update of another file it would go on with the old ones.
    """
    asked = SETTINGS.CACHE_DIR
    SETTINGS.CACHE_DIR = asked or str(folder / "__pycache__" / _digest(folder))
    try:
        yield
    finally:
        SETTINGS.CACHE_DIR = asked


@functools.cache
def _digest(folder: Path) -> str:
    """A short hash of the sources in a folder: paths must stay short on Windows."""
    total = hashlib.sha256()
    for source in sorted(folder.glob("*.py")):
        total.update(source.read_bytes())
    return total.hexdigest()[:8]
