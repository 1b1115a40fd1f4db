"""Divides the study: pairs into sessions, each with a seed, a rig file and a recording of its own.

Every session is one process's work of a minute or two, which is what breaking the study off costs, and some two hours
and a half of the simulated rig's time. It narrows its range of tilts only after 25 samples of a direction, as the
paper's does: until then steps are coarse, and blocks slide fast and far. Nothing but the foam turns a block there, and
in the paper's figures blocks lie at every angle: so each session begins with the block laid down at another place, and
turned on, so that the sessions of a pair part the quarter turn between two directions of tilting evenly.

The paper does not say how fast it tilts, only that a sample takes 22 s on average. The pause after each step is set to
come to that. It matters: on a plate that goes on tilting while the block slides, the block is fast when its slide is
detected, and ends at the border.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from shared.errors import UserError
from station.app.study.paper import PAIRS, PaperPair
from station.sampling.plan import Plan, TiltPlan

SESSION_SAMPLES = 400
"""The largest number of samples in a session."""
START_WITHIN_M = 0.01
"""A hand lays the block down this near to the middle of the plate."""
HOLD_S = 0.52
"""The pause after each step: with it a sample takes the paper's 22 s on average (`study.json` says how long)."""


@dataclass(frozen=True, kw_only=True)
class Part:
    """One session of the study: `number` of its pair from 1; `path` is where its recording is once it is whole.

    `yaw_rad` is how the block is laid down.
    """

    pair: PaperPair
    number: int
    samples: int
    seed: int
    yaw_rad: float
    path: Path

    @property
    def unfinished_path(self) -> Path:
        """The path of the growing recording: a session that was broken off never looks like a whole one."""
        return self.path.parent / "unfinished" / self.path.name


def parts_of(samples: int, *, seed: int, folder: Path, session_samples: int = SESSION_SAMPLES) -> tuple[Part, ...]:
    """Returns the sessions of a study with `samples` in all, steep pairs first: they take longest.

    Raises:
        UserError: if there is not one sample for each pair, or the seed is negative.
    """
    if samples < len(PAIRS) or seed < 0:
        raise UserError(f"Expected at least {len(PAIRS)} --samples and --seed of 0 or more, got {samples} and {seed}")
    parts: list[Part] = []
    for index, (pair, count) in enumerate(zip(PAIRS, _shares(samples, len(PAIRS)), strict=True)):
        sizes = _shares(count, math.ceil(count / session_samples))
        first = float(np.random.default_rng([seed, index]).uniform())
        for number, size in enumerate(sizes, start=1):
            parts.append(
                Part(
                    pair=pair,
                    number=number,
                    samples=size,
                    seed=int(np.random.SeedSequence([seed, index, number]).generate_state(1)[0]),
                    yaw_rad=(first + (number - 1) / len(sizes)) * math.pi / 2,
                    path=folder / f"{pair.preset}_{number:02}.mcap",
                )
            )
    return tuple(sorted(parts, key=lambda part: -part.pair.mean_rad))


def _shares(total: int, shares: int) -> list[int]:
    """Returns the whole in parts that differ by one at most."""
    return [total // shares + (share < total % shares) for share in range(shares)]


def plan_of(part: Part) -> Plan:
    """Returns the session's plan: the paper's, at the paper's pace."""
    return Plan(samples=part.samples, seed=part.seed, tilt=TiltPlan(hold_s=HOLD_S))


def place_of(part: Part) -> tuple[float, float]:
    """Returns the place on the plate (m) where the block is laid down: by chance, and the same whenever it is asked."""
    x_m, y_m = np.random.default_rng([part.seed, 1]).uniform(-START_WITHIN_M, START_WITHIN_M, 2).tolist()
    return x_m, y_m
