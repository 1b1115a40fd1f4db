"""Watches a program and all the processes that it starts, from outside, by what the system says of them."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
import psutil
from scipy.special import stdtrit

_BLOCKS = 20
"""Readings that follow each other are alike; the medians of so many stretches of them are taken as independent."""


@dataclass(frozen=True)
class Reading:
    """A program at one moment, with its children: `written_mb` is the size of what it records."""

    at_s: float
    memory_mb: float
    handles: float
    threads: float
    written_mb: float


def readings(program: psutil.Popen, recorded: Path, *, every_s: float) -> Iterator[Reading]:
    """Readings until the program ends."""
    begin = time.monotonic()
    while program.poll() is None:
        memory = handles = threads = 0
        for process in (program, *_children(program)):
            try:
                with process.oneshot():
                    memory += process.memory_info().rss
                    handles += process.num_fds()
                    threads += process.num_threads()
            except psutil.Error:  # it has just ended
                continue
        yield Reading(time.monotonic() - begin, memory / 1e6, handles, threads, _size(recorded) / 1e6)
        time.sleep(every_s)


def _children(program: psutil.Popen) -> list[psutil.Process]:
    try:
        return program.children(recursive=True)
    except psutil.Error:
        return []


def _size(recorded: Path) -> int:
    stem = recorded.name.removesuffix(".mcap")
    found = 0
    for path in recorded.parent.glob(f"{stem}*.mcap*"):
        try:
            found += path.stat().st_size
        except OSError:  # it has just got its name
            continue
    return found


def growth(found: Sequence[Reading], name: str) -> tuple[float, float]:
    """The medians of a quantity in the second quarter of the time and in the last: at first a program fills caches."""
    kept = [getattr(one, name) for one in found]
    parts = kept[len(kept) // 4 : len(kept) // 2], kept[3 * len(kept) // 4 :]
    middle = [sorted(part)[len(part) // 2] for part in parts]
    return middle[0], middle[1]


def slope(found: Sequence[Reading], name: str) -> tuple[float, float]:
    """The growth of a quantity for each GB recorded, after the first quarter, and half of its 95 % interval."""
    kept = found[len(found) // 4 :]
    blocks = [block for block in np.array_split(np.arange(len(kept)), _BLOCKS) if len(block)]
    values, written = (
        [float(np.median([getattr(kept[k], what) for k in block])) for block in blocks] for what in (name, "written_mb")
    )
    (rise, _), covariance = np.polyfit(np.array(written) / 1000, values, 1, cov=True)
    return float(rise), float(np.sqrt(covariance[0, 0]) * stdtrit(len(values) - 2, 0.975))


QUANTITIES = tuple(spec.name for spec in fields(Reading))[1:]
