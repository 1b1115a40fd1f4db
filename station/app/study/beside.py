"""The comparison with the paper as tables of text and as JSON; with rows that do not agree, why we believe so."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from station.app.outputs import without_nan
from station.app.study.compare import ALPHA, Row, Verdict
from station.app.study.paper import PAIRS, PaperPair
from station.friction.filters import FILTERS
from station.friction.report_table import ReportTable, chance, number
from station.friction.results import PairResult

BELIEVED = {
    "mean θ, rad, wood on wood": (
        "Planted is 0.39 rad as the mean over all directions, and the block slides where friction is low, so that the "
        "mean of its slides is lower: the rig's own bias, which the limit curve takes out. The paper's mean is one of "
        "slides, too."
    ),
    "flagged by distance": (
        "The paper's distance filter takes out false detections, by highlights on metal and tape: 134 of its 162 flags "
        "are of the steel object. The simulated camera has no highlights, and a true slide above 10° has gone more "
        "than 20 px when the slip rule (10 px and 1 px a degree) reports it."
    ),
    "flagged by circumference": (
        "The paper's circumference filter takes out errors of its marker detection; the simulated camera has noise "
        "only, of which three standard deviations leave 0.27 % in each of two circumferences."
    ),
    "flagged by border": (
        "The paper gives neither the size of the opening nor its rule for the border; here a slide counts that runs "
        "along the foam or into it where the block touches it."
    ),
    "filtered by any filter": "The sum of the filters' differences below.",
    "scatter (sd / mean), wood on wood": (
        "The planted scatter is 10 % in every direction, and the ellipse comes on top of it; the paper prints around "
        "10 % for both together."
    ),
}
"""Our explanations of rows that differ, by the beginning of their names; printed with the rows that do."""


def tables_of(
    rows: Sequence[Row], verdicts: Sequence[Verdict], results: Sequence[PairResult]
) -> tuple[ReportTable, ReportTable, ReportTable]:
    """Returns the numbers, the tests of anisotropy, and Table III, beside the paper's."""
    return (
        ReportTable(
            title="The study beside the paper",
            columns=("quantity, pair", "paper", "printed to ±", "simulated", "difference", "± se", "in se", "agrees"),
            rows=tuple(_cells(row) for row in rows),
            note=(
                "se: of both studies together, for one pair of the paper with a quarter of its samples. Agrees: the "
                "difference is at most two standard errors and the fineness of what is printed. Wood on wood has no "
                "printed mean: 0.39 is 0.35 and the difference of around 0.04." + _explained(rows)
            ),
        ),
        ReportTable(
            title="Anisotropy beside the paper (µ by the sliding direction against the object)",
            columns=("pair", "paper", "simulated", "n", "p", "p Holm", "explained ω²", "max/min µ", "chance", "agrees"),
            rows=tuple(_verdict_cells(verdict) for verdict in verdicts),
            note=f"Anisotropic: p Holm < {ALPHA:g}. Chance: the 95 % quantile of max/min µ without any anisotropy.",
        ),
        _filters_table(results),
    )


def _explained(rows: Sequence[Row]) -> str:
    """Returns the reasons of the rows that do not agree, each with the row's name."""
    names = [f"{row.quantity}, {row.pair}" for row in rows if not row.agrees]
    reasons = [(name, text) for name in names for start, text in BELIEVED.items() if name.startswith(start)]
    return "".join(f" Why {name} differs, we believe: {text}" for name, text in reasons)


def _filters_table(results: Sequence[PairResult]) -> ReportTable:
    found = {result.pair.name: result for result in results}
    known = [(pair, found[pair.name]) for pair in PAIRS if pair.name in found]
    return ReportTable(
        title="Table III beside the paper's (paper : simulated)",
        columns=("pair", "slid", "unique", "total", *FILTERS),
        rows=tuple(_filters_row(pair, result) for pair, result in known),
        note="The paper does not say how many samples a pair has; a quarter of all is 1582.",
    )


def _filters_row(pair: PaperPair, result: PairResult) -> tuple[str, ...]:
    counts, theirs = result.counts, pair.by_filter
    both = {"unique": (pair.unique, counts.unique), "total": (sum(theirs.values()), counts.total)}
    both |= {name: (theirs[name], counts.by_filter[name]) for name in FILTERS}
    return (pair.name, str(counts.samples), *(f"{paper} : {ours}" for paper, ours in both.values()))


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
        number(test.omega2, ".1%"),
        f"{test.ratio:.3f}",
        f"{test.ratio_by_chance:.3f}",
        _yes(verdict.agrees),
    )


def _yes(value: bool | None) -> str:
    return {True: "yes", False: "no", None: "–"}[value]


def as_json(rows: Sequence[Row], verdicts: Sequence[Verdict]) -> Mapping[str, Any]:
    """Returns the two tables with all digits; what is not a number is null."""
    tables = {
        "rows": [
            asdict(row)
            | {"difference": row.difference, "in_standard_errors": row.in_standard_errors}
            | {"agrees": row.agrees}
            for row in rows
        ],
        "anisotropy": [
            {"pair": one.pair, "paper": one.paper, "found": one.found, "agrees": one.agrees}
            | {"test": one.test and asdict(one.test)}
            for one in verdicts
        ],
    }
    return without_nan(tables)
