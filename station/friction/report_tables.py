"""The analysis as tables of text: Table III, the results by pair and direction, and the tests."""

from __future__ import annotations

import math
from collections.abc import Sequence

from station.friction.anisotropy import AnisotropyTest
from station.friction.filters import FILTERS, FilterCounts
from station.friction.report_curves import curve_tables
from station.friction.report_table import ReportTable, chance, number
from station.friction.results import PairResult, Summary
from station.friction.robust import ALTERNATIVES


def tables(results: Sequence[PairResult]) -> tuple[ReportTable, ...]:
    """Returns all tables, in the order in which they are read."""
    return (
        _filter_table(results),
        _alternatives_table(results),
        _pairs_table(results),
        _directions_table(results),
        _anisotropy_table(results),
        *curve_tables(results),
    )


def _filter_table(results: Sequence[PairResult]) -> ReportTable:
    rows = [_counts_row(result.pair.name, result.counts, _applicable_filters(result)) for result in results]
    if len(results) > 1:
        every = [result.counts for result in results]
        rows.append(
            _counts_row("all", _sum(every), set[str]().union(*(_applicable_filters(result) for result in results)))
        )
    return ReportTable(
        title="Filtered samples (the paper's Table III)",
        columns=("pair", "slid", "unique", "%", "total", *FILTERS, "censored"),
        rows=tuple(rows),
        note="Slid counts the samples whose block slid, which the filters judge, unique those that any filter flagged, "
        "and total the flags. A dash stands where a filter could not judge anything.",
    )


def _applicable_filters(result: PairResult) -> set[str]:
    """Returns the filters that could judge any slide of a pair."""
    return {name for name, applicable in result.pair.flags.applicable.items() if applicable.any()}


def _counts_row(name: str, counts: FilterCounts, applicable: set[str]) -> tuple[str, ...]:
    share = number(counts.unique / counts.samples, ".1%") if counts.samples else "–"
    by_filter = (
        str(flagged) if filter_name in applicable else "–" for filter_name, flagged in counts.by_filter.items()
    )
    return (name, str(counts.samples), str(counts.unique), share, str(counts.total), *by_filter, str(counts.censored))


def _sum(every: Sequence[FilterCounts]) -> FilterCounts:
    return FilterCounts(
        samples=sum(one.samples for one in every),
        censored=sum(one.censored for one in every),
        unique=sum(one.unique for one in every),
        total=sum(one.total for one in every),
        by_filter={name: sum(one.by_filter[name] for one in every) for name in FILTERS},
    )


def _alternatives_table(results: Sequence[PairResult]) -> ReportTable:
    rows: list[tuple[str, ...]] = []
    for result in results:
        counts, paper, robust = result.robust_counts, result.pair.flags.flagged, result.pair.robust.by_filter
        without_leaning = robust["angle_mad"] | robust["circumference_mad"] | robust["multivariate"]
        rows.append(
            (
                result.pair.name,
                *(str(counts.by_filter[name]) for name in ALTERNATIVES),
                str(int((without_leaning & ~paper).sum())),
                str(int((paper & ~without_leaning).sum())),
            )
        )
    return ReportTable(
        title="Robust alternatives (flagged beside the paper's filters; the results do not use them)",
        columns=("pair", "angle MAD", "circumf. MAD", "multivariate", "leaning", "only robust", "only paper"),
        rows=tuple(rows),
        note="Leaning counts the samples whose block touched the foam before it slid. Only robust counts those "
        "that the first three flagged and no filter of the paper did, and only paper those of which the reverse holds.",
    )


def _pairs_table(results: Sequence[PairResult]) -> ReportTable:
    return ReportTable(
        title="Results by surface pair (kept samples)",
        columns=("pair", *_SUMMARY),
        rows=tuple((result.pair.name, *_summary_row(result.summary)) for result in results),
    )


def _directions_table(results: Sequence[PairResult]) -> ReportTable:
    return ReportTable(
        title="Results by tilting direction (kept samples)",
        columns=("pair, direction", *_SUMMARY),
        rows=tuple(
            (f"{result.pair.name}, {'free' if direction < 0 else direction}", *_summary_row(summary))
            for result in results
            for direction, summary in result.directions.items()
        ),
    )


_SUMMARY = ("n", "mean θ °", "± se °", "sd °", "mean µ", "sd µ", "scatter")


def _summary_row(summary: Summary) -> tuple[str, ...]:
    angles = (summary.theta_rad, summary.standard_error_rad, summary.theta_sd_rad)
    return (
        str(summary.samples),
        *(number(math.degrees(value), ".2f") for value in angles),
        *(number(value, ".4f") for value in (summary.mu, summary.mu_sd)),
        number(summary.scatter, ".1%"),
    )


def _anisotropy_table(results: Sequence[PairResult]) -> ReportTable:
    rows = [
        (f"{result.pair.name}, against {relation}", *_test_row(test))
        for result in results
        for relation, test in (("object", result.object_test), ("plate", result.plate_test))
    ]
    return ReportTable(
        title="Anisotropy: does µ depend on the sliding direction?",
        columns=(
            "pair",
            "n",
            "p",
            "p Holm",
            "p F test",
            "p given other",
            "max/min µ",
            "by chance",
            "explained",
            "at °",
        ),
        rows=tuple(rows),
        note=(
            "Harmonics 1 and 2 of ln µ are tested after a trend over the session is taken out. p is by permutations, p "
            "Holm is adjusted for the number of tests, and p given other is of an F test beside the harmonics of the "
            "other relation. By chance is the 95 % quantile of max/min µ without any anisotropy; as a p weighs all "
            "directions, it may be small where that ratio is not exceeded. Explained is ω² of the direction, and the "
            "last column has the direction of the highest friction."
        ),
    )


def _test_row(test: AnisotropyTest | None) -> tuple[str, ...]:
    if test is None:
        return ("–",) * 9
    chances = (test.p_value, test.p_adjusted, test.p_f, test.p_given_other)
    return (
        str(test.samples),
        *(chance(p) for p in chances),
        f"{test.ratio:.3f}",
        f"{test.ratio_by_chance:.3f}",
        number(test.omega2, ".1%"),
        f"{math.degrees(test.highest_rad) % 360:.0f}",
    )
