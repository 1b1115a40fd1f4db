"""The simulated study beside the paper: one row for each number that the paper prints.

A difference is given in standard errors, which are those of both studies: the paper's means and shares come from a
finite number of samples, too (for one pair a quarter of all, as the paper does not divide them). What remains is how
finely the paper prints its numbers: "around 0.2" can be anything from 0.15 to 0.25. A row agrees if the difference is
at most two standard errors and half of the last printed digit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from station.app.study import paper
from station.app.study.paper import PAIRS, PaperPair
from station.friction.anisotropy import AnisotropyTest
from station.friction.filters import FILTERS
from station.friction.pairs import Session
from station.friction.results import PairResult

ALPHA = 0.01
"""Friction that depends on the direction is said to do so at this p, adjusted for the number of tests (Holm)."""
SIGMAS = 2.0
_QUARTER = (paper.SAMPLES - paper.FILTERED) / len(PAIRS)


@dataclass(frozen=True, kw_only=True)
class Row:
    """A number of the paper and the simulated one; `standard_error` is that of their difference.

    `printed_to` is half of the last printed digit's unit, `form` how both are written.
    """

    quantity: str
    pair: str
    paper: float
    printed_to: float
    simulated: float
    standard_error: float
    form: str

    @property
    def difference(self) -> float:
        """Simulated minus paper."""
        return self.simulated - self.paper

    @property
    def in_standard_errors(self) -> float:
        """The difference over its standard error; NaN without one."""
        return self.difference / self.standard_error if self.standard_error > 0 else math.nan

    @property
    def agrees(self) -> bool:
        """True if printing and scatter explain the difference."""
        return abs(self.difference) <= self.printed_to + SIGMAS * self.standard_error


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """The answers of the paper and of the test to the question if a pair's friction depends on the direction."""

    pair: str
    paper: bool
    test: AnisotropyTest | None

    @property
    def found(self) -> bool | None:
        """True if the test finds it; None if it could not be made."""
        return None if self.test is None else self.test.p_adjusted < ALPHA

    @property
    def agrees(self) -> bool | None:
        """True if the test says what the paper says."""
        return None if self.found is None else self.found == self.paper


def rows_of(results: Sequence[PairResult]) -> tuple[Row, ...]:
    """Returns the rows of every pair of the paper that has results, then those of the whole study."""
    found = {result.pair.name: result for result in results}
    known = [(pair, found[pair.name]) for pair in PAIRS if pair.name in found]
    makers: tuple[Callable[[PaperPair, PairResult], Row], ...] = (_mean, _scatter)
    rows = [make(pair, result) for make in makers for pair, result in known]
    slides = sum(result.counts.samples for result in results)
    shares = {"filtered": (paper.FILTERED, sum(result.counts.unique for result in results))}
    for name in FILTERS:
        shares[name] = (paper.flags_of(name), sum(result.counts.by_filter[name] for result in results))
    return (*rows, *(_share(name, *counts, slides=slides) for name, counts in shares.items()))


def pace_row(sessions: Sequence[Session]) -> Row:
    """Returns the time that a sample takes on the simulated rig, from start to start, beside the paper's 22 s."""
    means: list[float] = []
    for session in sessions:
        starts_s = [1e-9 * sample.start_ns for sample in session.samples]
        means += [(starts_s[-1] - starts_s[0]) / (len(starts_s) - 1)] * len(starts_s) if len(starts_s) > 1 else []
    return Row(
        quantity="seconds a sample",
        pair="all",
        paper=paper.SECONDS_PER_SAMPLE,
        printed_to=0.5,
        simulated=math.fsum(means) / len(means) if means else math.nan,
        standard_error=0.0,
        form=".1f",
    )


def verdicts_of(results: Sequence[PairResult]) -> tuple[Verdict, ...]:
    """Returns the test of every pair of the paper that has results, against the object: so the paper looks at it."""
    found = {result.pair.name: result for result in results}
    return tuple(
        Verdict(pair=pair.name, paper=pair.anisotropic, test=found[pair.name].object_test)
        for pair in PAIRS
        if pair.name in found
    )


def _mean(pair: PaperPair, result: PairResult) -> Row:
    theirs = pair.mean_rad * pair.scatter / math.sqrt(_QUARTER)
    return Row(
        quantity="mean θ, rad",
        pair=pair.name,
        paper=pair.mean_rad,
        printed_to=pair.mean_to_rad,
        simulated=result.summary.theta_rad,
        standard_error=math.hypot(result.summary.standard_error_rad, theirs),
        form=".4f",
    )


def _scatter(pair: PaperPair, result: PairResult) -> Row:
    summary = result.summary
    return Row(
        quantity="scatter (sd / mean)",
        pair=pair.name,
        paper=pair.scatter,
        printed_to=pair.scatter_to,
        simulated=summary.scatter,
        standard_error=math.hypot(_scatter_error(summary.scatter, summary.samples), _scatter_error(pair.scatter)),
        form=".1%",
    )


def _scatter_error(scatter: float, samples: float = _QUARTER) -> float:
    """Returns the standard error of sd / mean of normal values."""
    return scatter * math.sqrt(0.5 + scatter**2) / math.sqrt(samples) if samples else math.nan


def _share(name: str, theirs: int, ours: int, *, slides: int) -> Row:
    """Shares of samples, compared with the error of the shared proportion: ours may well be none at all."""
    together = (theirs + ours) / (paper.SAMPLES + slides)
    spread = math.sqrt(together * (1 - together) * (1 / paper.SAMPLES + 1 / slides)) if slides else math.nan
    return Row(
        quantity=f"{name} by any filter" if name == "filtered" else f"flagged by {name}",
        pair="all",
        paper=theirs / paper.SAMPLES,
        printed_to=0.0,
        simulated=ours / slides if slides else math.nan,
        standard_error=spread,
        form=".1%",
    )
