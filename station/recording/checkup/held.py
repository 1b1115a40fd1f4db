"""Runs in a row in which the block was held: it did not slip up to the highest angle that was tried.

A block that lies where friction is above the narrowed range of angles may lie there for ever, and so may one whose
frames are frozen or whose mark is hidden. Each such run is kept as censored, and the session looks complete.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise

from shared.messages import Sample

BY_CHANCE = 1e-3
"""Runs in a row are told of if fewer than this share of sessions have as many by chance, were each run held on its own:
one good session in a thousand is suspected. The least number follows from the session: 5 of 2500 runs in
a session that holds one run in 25 (`pytest tests/unit/recording/test_held.py`).
"""


@dataclass(frozen=True, kw_only=True)
class Held:
    """`count` runs in a row from `first` to `last` that were held at tilts up to `low_rad` to `high_rad`.

    `chance` bounds the probability of as many in a row; `farthest_rad` is how far another run of the session was tilted
    in one of these directions, 0 if none was tilted farther.
    """

    first: int
    last: int
    count: int
    low_rad: float
    high_rad: float
    chance: float
    farthest_rad: float


def held_in_a_row(samples: Sequence[Sample]) -> tuple[Held, ...]:
    """Finds more runs in a row that were held than would be by chance; disturbed and tipped runs tell nothing."""
    informative = [sample for sample in samples if not sample.disturbed and "tipped" not in sample.flags]
    farthest = dict[int, float]()
    for sample in informative:
        farthest[sample.direction] = max(sample.step_to_rad, farthest.get(sample.direction, 0.0))
    chance = _chance([sample.censored for sample in informative])
    rows = [list(row) for held, row in groupby(informative, key=lambda sample: sample.censored) if held]
    unlikely = ((row, len(informative) * chance ** len(row)) for row in rows)
    return tuple(_held(row, by_chance, farthest) for row, by_chance in unlikely if by_chance < BY_CHANCE)


def _chance(held: Sequence[bool]) -> float:
    """Returns the probability that a run is held, from the runs after one that slipped (Laplace's rule of succession).

    Runs after a held one are what is judged: one long row would else excuse itself. That a row of r begins at one of n
    runs has at most the probability n times its r-th power.
    """
    after = [now for before, now in pairwise(held) if not before]
    return (sum(after) + 1) / (len(after) + 2)


def _held(row: Sequence[Sample], chance: float, farthest: dict[int, float]) -> Held:
    tops = [sample.step_to_rad for sample in row]
    most = max(farthest[sample.direction] for sample in row)
    return Held(
        first=row[0].run,
        last=row[-1].run,
        count=len(row),
        low_rad=min(tops),
        high_rad=max(tops),
        chance=chance,
        farthest_rad=most if most > max(tops) else 0.0,
    )
