"""The simulated study beside the paper: one row for each number that the paper prints.

A difference is given in standard errors, which are those of both studies: the paper's means and shares come from a
finite number of samples, too (for one pair a quarter of all, as the paper does not divide them). What remains is how
finely the paper prints its numbers: "around 0.2" can be anything from 0.15 to 0.25. A row agrees if the difference is
at most two standard errors and half of the last printed digit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from station.app.study import paper
from station.app.study.paper import PAIRS, PaperPair
from station.friction.anisotropy import AnisotropyTest
from station.friction.filters import FILTERS
from station.friction.report_table import ReportTable, chance, number
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
        """Whether printing and scatter explain the difference."""
        return abs(self.difference) <= self.printed_to + SIGMAS * self.standard_error


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """Whether a pair's friction depends on the direction: what the paper says, and what the test does."""

    pair: str
    paper: bool
    test: AnisotropyTest | None

    @property
    def found(self) -> bool | None:
        """Whether the test finds it; None if it could not be made."""
        return None if self.test is None else self.test.p_adjusted < ALPHA

    @property
    def agrees(self) -> bool | None:
        """Whether the test says what the paper says."""
        return None if self.found is None else self.found == self.paper


def rows_of(results: Sequence[PairResult]) -> tuple[Row, ...]:
    """The rows of every pair of the paper that has results, then those of the whole study."""
    found = {result.pair.name: result for result in results}
    known = [(pair, found[pair.name]) for pair in PAIRS if pair.name in found]
    makers: tuple[Callable[[PaperPair, PairResult], Row], ...] = (_mean, _scatter)
    rows = [make(pair, result) for make in makers for pair, result in known]
    slides = sum(result.counts.samples for result in results)
    shares = {"filtered": (paper.FILTERED, sum(result.counts.unique for result in results))}
    for name in FILTERS:
        shares[name] = (paper.flags_of(name), sum(result.counts.by_filter[name] for result in results))
    return (*rows, *(_share(name, *counts, slides=slides) for name, counts in shares.items()))


def verdicts_of(results: Sequence[PairResult]) -> tuple[Verdict, ...]:
    """The test of every pair of the paper that has results, against the object: so the paper looks at it."""
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
    """Standard error of sd / mean of normal values."""
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


def tables_of(rows: Sequence[Row], verdicts: Sequence[Verdict]) -> tuple[ReportTable, ReportTable]:
    """The numbers, and the tests of anisotropy, beside the paper's."""
    return (
        ReportTable(
            title="The study beside the paper",
            columns=("quantity, pair", "paper", "printed to ±", "simulated", "difference", "± se", "in se", "agrees"),
            rows=tuple(_cells(row) for row in rows),
            note=(
                "se: of both studies together, for one pair of the paper with a quarter of its samples. Agrees: the "
                "difference is at most two standard errors and the fineness of what is printed. Wood on wood has no "
                "printed mean: 0.39 is 0.35 and the difference of around 0.04."
            ),
        ),
        ReportTable(
            title="Anisotropy beside the paper (µ by the sliding direction against the object)",
            columns=("pair", "paper", "simulated", "n", "p", "p Holm", "explained ω²", "max/min µ", "chance", "agrees"),
            rows=tuple(_verdict_cells(verdict) for verdict in verdicts),
            note=f"Anisotropic: p Holm < {ALPHA:g}. Chance: the 95 % quantile of max/min µ without any anisotropy.",
        ),
    )


def _cells(row: Row) -> tuple[str, ...]:
    values = (row.paper, row.printed_to, row.simulated)
    signed = "+" + row.form
    return (
        f"{row.quantity}, {row.pair}",
        *(number(value, row.form) for value in values),
        number(row.difference, signed),
        number(row.standard_error, row.form.replace("1%", "2%")),
        number(row.in_standard_errors, "+.1f"),
        _yes(row.agrees),
    )


def _verdict_cells(verdict: Verdict) -> tuple[str, ...]:
    words = {True: "anisotropic", False: "isotropic", None: "–"}
    start = (verdict.pair, words[verdict.paper], words[verdict.found])
    if (test := verdict.test) is None:
        return (*start, *("–",) * 7)
    return (
        *start,
        str(test.samples),
        chance(test.p_value),
        chance(test.p_adjusted),
        f"{test.omega2:.1%}",
        f"{test.ratio:.3f}",
        f"{test.ratio_by_chance:.3f}",
        _yes(verdict.agrees),
    )


def _yes(value: bool | None) -> str:
    return {True: "yes", False: "no", None: "–"}[value]


def as_json(rows: Sequence[Row], verdicts: Sequence[Verdict]) -> Mapping[str, Any]:
    """Both tables with all digits; what is not a number is null."""
    return {
        "rows": [
            {key: _plain(value) for key, value in asdict(row).items()}
            | {"difference": _plain(row.difference), "in_standard_errors": _plain(row.in_standard_errors)}
            | {"agrees": row.agrees}
            for row in rows
        ],
        "anisotropy": [
            {"pair": one.pair, "paper": one.paper, "found": one.found, "agrees": one.agrees}
            | {"test": one.test and {key: _plain(value) for key, value in asdict(one.test).items()}}
            for one in verdicts
        ],
    }


def _plain(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value
