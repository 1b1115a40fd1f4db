"""Compiles numerical functions, and caches the machine code where that is possible."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import njit


def compiled(function: Callable[..., Any]) -> Any:
    """The function, compiled by numba when it is first called.

    Machine code is kept beside the source, else in the user's cache. Where neither can be written (a read-only home)
    numba refuses; then each process compiles anew, which takes seconds and changes no number.

    A division by zero gives inf or nan, as in NumPy. Python's exception would cost a branch at each division, which
    keeps loops from being vectorised: the law of breakaways took 1.85 times as long, for the same bits.
    """
    try:
        return njit(cache=True, error_model="numpy")(function)
    except RuntimeError:
        return njit(error_model="numpy")(function)
