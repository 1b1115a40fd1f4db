"""The variants under which the suite runs: code paths of other processors, thread counts, and a busy machine."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from tests.portable.paths import Paths

PLAINEST = "plainest"
BUSY = 8
"""Busy processes beside the suite: four for each of the two cores of a small laptop."""
X86, ARM = ("Prescott", "Nehalem", "Haswell", "SkylakeX"), ("ARMV8",)
CORES = {"x86_64": X86, "AMD64": X86, "aarch64": ARM, "arm64": ARM}
"""OpenBLAS's processors by machine, as the systems call it; the oldest come first."""
NEEDS = {"Haswell": "AVX2", "SkylakeX": "AVX512-SKX"}
"""The instruction set without which a core's code cannot run, as OpenCV calls it."""


@dataclass(frozen=True)
class Variant:
    """One way to run the suite: environment variables on top of those here, and busy processes beside it."""

    name: str
    about: str
    environment: Mapping[str, str] = field(default_factory=dict[str, str])
    busy: int = 0


def variants(here: Paths, *, machine: str = platform.machine()) -> list[Variant]:
    """Everything that may change an answer from one machine to another; the first has all older code paths at once.

    Args:
        here: the code paths that are taken without any of the variables.
        machine: as `platform.machine` calls it.
    """
    numpy = Variant("numpy", "numpy's own loops for its baseline", {"NPY_DISABLE_CPU_FEATURES": " ".join(here.numpy)})
    opencv = Variant(
        "opencv",
        "OpenCV's own loops for its baseline, without IPP",
        {"OPENCV_CPU_DISABLE": ",".join(here.opencv), "OPENCV_IPP": "disabled", "OPENCV_LOG_LEVEL": "ERROR"},
    )
    libm = Variant("libm", "the C library without FMA", {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4"})
    numba = Variant("numba", "numba's code for any processor", {"NUMBA_CPU_NAME": "generic"})
    blas = [
        Variant(f"blas-{core.lower()}", f"OpenBLAS's code for {core}", {"OPENBLAS_CORETYPE": core})
        for core in CORES.get(machine, ())
        if NEEDS.get(core) in {None, *here.opencv}
    ]
    oldest = [numpy, *blas[:1], opencv, libm, numba, threads(1)]
    # A value that is empty here was taken away before: an empty list would bring it back.
    together = {name: value for one in oldest for name, value in one.environment.items() if value}
    return [
        Variant(PLAINEST, "all older code paths at once, in one thread", together),
        Variant("load", f"{BUSY} busy processes beside it", busy=BUSY),
        *(numpy, *blas, opencv, libm, numba, threads(1), threads(2)),
    ]


def threads(count: int) -> Variant:
    """Every library in so many threads."""
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OPENCV_FOR_THREADS_NUM", "NUMBA_NUM_THREADS")
    noun = "thread" if count == 1 else "threads"
    return Variant(f"threads-{count}", f"{count} {noun} in every library", dict.fromkeys(names, str(count)))


def taken(variant: Variant) -> Paths:
    """The code paths that a fresh process takes under a variant."""
    words = [sys.executable, "-m", "tests.portable.paths"]
    done = subprocess.run(words, env={**os.environ, **variant.environment}, capture_output=True, text=True, check=True)
    found: dict[str, Any] = json.loads(done.stdout)
    lists: dict[str, Any] = {name: tuple(value) for name, value in found.items() if isinstance(value, list)}
    return Paths(**{**found, **lists})
