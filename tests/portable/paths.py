"""`python -m tests.portable.paths`: the code paths that the numeric libraries take in this process, as JSON."""

from __future__ import annotations

import ctypes
import hashlib
import json
import math
import random
import struct
import sys
from dataclasses import asdict, dataclass
from pathlib import Path

import cv2
import numpy as np
from numba.core import config as numba_config
from numpy._core import _multiarray_umath as core  # pyright: ignore  # no public name tells it

CORE_NAMES = ("scipy_openblas_get_corename64_", "scipy_openblas_get_corename", "openblas_get_corename")
"""The functions by which numpy's and scipy's copies of OpenBLAS name the processor that they work for."""


@dataclass(frozen=True)
class Paths:
    """`numpy` and `opencv`: instruction sets beyond their baseline; `libm`: a digest of a thousand answers."""

    numpy: tuple[str, ...]
    opencv: tuple[str, ...]
    ipp: bool
    openblas: tuple[str, ...]
    numba: str
    libm: str
    threads: tuple[int, int]


def paths() -> Paths:
    """The code paths of this process."""
    return Paths(
        numpy=_numpy(),
        opencv=tuple(
            name[1:] for name in cv2.getCPUFeaturesLine().split() if name.startswith("*") and not name.endswith("?")
        ),
        ipp=bool(cv2.ipp.useIPP()),
        openblas=_openblas(),
        numba=str(numba_config.CPU_NAME or "host"),  # pyright: ignore  # made when it is imported
        libm=_libm(),
        # numba.get_num_threads() would start them, and numba then refuses to compile once the environment has changed
        threads=(cv2.getNumThreads(), int(numba_config.NUMBA_NUM_THREADS)),  # pyright: ignore  # as above
    )


def _numpy() -> tuple[str, ...]:
    return tuple(name for name in core.__cpu_dispatch__ if core.__cpu_features__[name])


def _openblas() -> tuple[str, ...]:
    """The processor that each copy of OpenBLAS beside numpy works for; none where numpy uses another BLAS."""
    names: list[str] = []
    for library in _libraries():
        loaded = ctypes.CDLL(str(library))
        for function in (getattr(loaded, name) for name in CORE_NAMES if hasattr(loaded, name)):
            function.restype = ctypes.c_char_p
            names.append(function().decode())
    return tuple(names)


def _libraries() -> list[Path]:
    """The wheels' own copies: Linux and Windows keep them beside a package, macOS inside it."""
    packages = Path(np.__file__).parents[1]
    return sorted(file for place in ("*.libs", "*/.dylibs") for file in packages.glob(f"{place}/*openblas*"))


def _libm() -> str:
    """The C library's answers differ in the last bit between processors with and without FMA."""
    numbers = random.Random(1)
    digest = hashlib.sha256()
    for _ in range(1000):
        x = numbers.uniform(0.01, 3.0)
        digest.update(struct.pack("5d", math.exp(x), math.sin(x), math.tan(x), math.log(x), x**1.37))
    return digest.hexdigest()[:8]


if __name__ == "__main__":
    json.dump(asdict(paths()), sys.stdout)
