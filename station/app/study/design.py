"""How the study is divided: pairs into sessions, each with a seed, a rig file and a recording of its own.

Every session is one process's work of a minute or so, which is what breaking the study off costs. A session narrows
its range of tilts only after 25 samples of a direction, as the paper's does, so that short sessions take longer.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from shared.errors import UserError
from station.app.study.paper import PAIRS, PaperPair

SESSION_SAMPLES = 400
"""At most so many in a session."""


@dataclass(frozen=True, kw_only=True)
class Part:
    """One session of the study: `number` of its pair from 1; `path` is where its recording is once it is whole."""

    pair: PaperPair
    number: int
    samples: int
    seed: int
    path: Path

    @property
    def unfinished_path(self) -> Path:
        """Where the recording grows: a session that was broken off never looks like a whole one."""
        return self.path.parent / "unfinished" / self.path.name


def parts_of(samples: int, *, seed: int, folder: Path, session_samples: int = SESSION_SAMPLES) -> tuple[Part, ...]:
    """The sessions of a study with `samples` in all, steep pairs first: they take longest.

    Raises:
        UserError: if there is not one sample for each pair, or the seed is negative.
    """
    if samples < len(PAIRS) or seed < 0:
        raise UserError(f"Expected at least {len(PAIRS)} --samples and --seed of 0 or more, got {samples} and {seed}")
    parts: list[Part] = []
    for index, (pair, count) in enumerate(zip(PAIRS, _shares(samples, len(PAIRS)), strict=True)):
        sizes = _shares(count, math.ceil(count / session_samples))
        for number, size in enumerate(sizes, start=1):
            parts.append(
                Part(
                    pair=pair,
                    number=number,
                    samples=size,
                    seed=int(np.random.SeedSequence([seed, index, number]).generate_state(1)[0]),
                    path=folder / f"{pair.preset}_{number:02}.mcap",
                )
            )
    return tuple(sorted(parts, key=lambda part: -part.pair.mean_rad))


def _shares(total: int, shares: int) -> list[int]:
    """The whole in parts that differ by one at most."""
    return [total // shares + (share < total % shares) for share in range(shares)]
