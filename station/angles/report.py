"""A comparison as text (Table I as in the paper) and as CSV; degrees, because a person reads them."""

from __future__ import annotations

import math

from shared.csv_text import csv_lines
from station.angles.compare import Comparison, Estimate, Pair, SourceFit

_PAIR_COLUMNS = ("first", "second", "mean_abs_deg", "sd_deg", "bias_deg", "instants")
_FIT_COLUMNS = (
    *("source", "reference", "stops", "readings", "offset_deg", "offset_low_deg", "offset_high_deg"),
    *("gain", "gain_low", "gain_high", "hysteresis_deg", "hysteresis_low_deg", "hysteresis_high_deg"),
    *("noise_deg", "scatter_deg", "suspect"),
)


def text_of(comparison: Comparison) -> str:
    """Returns Table I and the fits, ready to print."""
    remarks = remarks_of(comparison)
    tables = [f"{title}\n{_grid(rows)}" for title, rows in (table_one(comparison), fit_table(comparison))]
    return "\n\n".join([*tables, *(["\n".join(remarks)] if remarks else [])])


def table_one(comparison: Comparison) -> tuple[str, list[list[str]]]:
    """Returns Table I as the paper prints it: its title, and rows of cells, the first one the head."""
    cells = {(pair.first, pair.second): pair for pair in comparison.pairs}
    rows = [["degrees", *comparison.sources]]
    for name in comparison.sources:
        row = [cells.get((name, other)) or cells.get((other, name)) for other in comparison.sources]
        rows.append([name, *("0 ± 0" if cell is None else _cell(cell) for cell in row)])
    title = (
        f"Table I: mean absolute difference ± standard deviation of the difference, degrees ({comparison.stops} stops)"
    )
    return title, rows


def _cell(pair: Pair) -> str:
    if not pair.count:
        return "-"
    return f"{math.degrees(pair.mean_abs_rad):.2f} ± {math.degrees(pair.sd_rad):.2f}"


def fit_table(comparison: Comparison) -> tuple[str, list[list[str]]]:
    """Returns the fitted model of each source: the title, and rows of cells, the first one the head."""
    rows = [["source", "offset", "gain", "hysteresis", "noise", "scatter", "readings", "suspect"]]
    for fit in comparison.fits:
        row = [fit.source, _interval(fit.offset, degrees=True), _interval(fit.gain, degrees=False)]
        row += [_interval(fit.hysteresis, degrees=True), _degrees(fit.noise_rad), _degrees(fit.scatter_rad)]
        rows.append([*row, str(fit.readings), str(fit.suspect)])
    title = (
        f"Against the reference ({comparison.reference}): y - r = offset + (gain - 1) r + hysteresis u / 2, "
        "degrees, 95 % intervals"
    )
    return title, rows


def remarks_of(comparison: Comparison) -> list[str]:
    """Returns sentences about readings far outside a source's noise, and about stops that a source has not seen."""
    remarks = [
        f"{fit.source}: {fit.suspect} of {fit.readings} readings lie far outside its noise: it jumped, or was touched."
        for fit in comparison.fits
        if fit.suspect
    ]
    most = max((fit.stops for fit in comparison.fits), default=0)
    remarks += [
        f"{fit.source}: readings at {fit.stops} of {comparison.stops} stops only."
        for fit in comparison.fits
        if fit.stops < max(most, comparison.stops)
    ]
    return remarks


def _interval(estimate: Estimate | None, *, degrees: bool) -> str:
    if estimate is None:
        return "-"
    if degrees:
        low, value, high = (math.degrees(x) for x in (estimate.low, estimate.value, estimate.high))
        return f"{value:+z.3f} [{low:+z.3f}, {high:+z.3f}]"
    return f"{estimate.value:.4f} [{estimate.low:.4f}, {estimate.high:.4f}]"


def _degrees(angle_rad: float) -> str:
    return f"{math.degrees(angle_rad):.3f}" if math.isfinite(angle_rad) else "-"


def _grid(rows: list[list[str]]) -> str:
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = ["  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    return "\n".join([lines[0], "-" * (sum(widths) + 2 * (len(widths) - 1)), *lines[1:]])


def table_csv(comparison: Comparison) -> str:
    """Returns Table I with one row a pair."""
    rows = [
        (
            *(pair.first, pair.second, _number(math.degrees(pair.mean_abs_rad)), _number(math.degrees(pair.sd_rad))),
            *(_number(math.degrees(pair.bias_rad)), str(pair.count)),
        )
        for pair in comparison.pairs
    ]
    return "".join(csv_lines([_PAIR_COLUMNS, *rows]))


def fits_csv(comparison: Comparison) -> str:
    """Returns the fitted model with one row a source; empty cells where the stops do not determine a term."""
    return "".join(csv_lines([_FIT_COLUMNS, *(_fit_row(fit, comparison.reference) for fit in comparison.fits)]))


def _fit_row(fit: SourceFit, reference: str) -> tuple[str, ...]:
    return (
        *(fit.source, reference, str(fit.stops), str(fit.readings)),
        *_three(fit.offset, degrees=True),
        *_three(fit.gain, degrees=False),
        *_three(fit.hysteresis, degrees=True),
        *(_number(math.degrees(fit.noise_rad)), _number(math.degrees(fit.scatter_rad)), str(fit.suspect)),
    )


def _three(estimate: Estimate | None, *, degrees: bool) -> tuple[str, str, str]:
    if estimate is None:
        return ("", "", "")
    scale = 180 / math.pi if degrees else 1.0
    return (_number(estimate.value * scale), _number(estimate.low * scale), _number(estimate.high * scale))


def _number(value: float) -> str:
    return f"{value:.6f}" if math.isfinite(value) else ""
