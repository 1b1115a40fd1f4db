"""The summary for the terminal, which a tired person understands in ten seconds."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from shared.notes import note_line
from station.diagnosis.report.html import p_equals
from station.diagnosis.report.sentences import (
    PATH_ERROR,
    acts,
    as_expected,
    in_order,
    left_out,
    next_lines,
    own_level,
    sentence,
    set_differently,
    singular,
    used,
)
from station.diagnosis.result import Diagnosis, EffectFound, FitQuality, Quality, Side, read_name, rounded

MOST_PLACES = 4
LEAST_SHOWN, MOST_DIGITS = 0.005, 6
"""A standard error that two digits after the point would show as 0.00 gets as many digits as it takes, up to six."""
_COLOUR = {"supported": "green", "indistinguishable": "yellow", "not supported": "cyan", "untestable": "red"}


def summary(diagnosis: Diagnosis) -> RenderableType:
    """Returns the verdict first, then effects, places, improvement and the next step.

    Against a given simulation: what both set differently, what it lacks, what it has alone, and its numerics.
    """
    parts: list[RenderableType] = [_headline(diagnosis)]
    parts += [Text(why) for why in (left_out(diagnosis),) if why]
    parts += [Text(f"Set differently: {said}") for said in set_differently(diagnosis)]
    if diagnosis.verdict == "untestable":
        return Group(*parts, *(Text(f"  {note}") for note in diagnosis.notes))
    if diagnosis.effects:
        parts.append(_effects(diagnosis))
    if diagnosis.given:
        parts += _numerics(diagnosis)
    where = [f"{place.summary} ({p_equals(place.p)})" for place in diagnosis.located[:MOST_PLACES]]
    where += acts(diagnosis)
    parts += [Text("Where:")] if where else []
    parts += [Text(f"  {line}") for line in where]
    parts.append(_fit(diagnosis))
    if not diagnosis.given:
        parts += _numerics(diagnosis)
    parts += _simulated(diagnosis)
    if diagnosis.next_experiment is not None:
        parts += [Text(line) for line in next_lines(diagnosis)]
    if diagnosis.untestable:
        parts.append(Text(f"Untestable with this recording: {', '.join(sorted(diagnosis.untestable))}"))
    parts += [Text(note_line(note)) for note in diagnosis.notes]
    return Group(*parts)


def _headline(diagnosis: Diagnosis) -> Text:
    line = Text()
    line.append(f"{diagnosis.recording}: ")
    line.append(sentence(diagnosis), style=f"bold {_COLOUR[diagnosis.verdict]}")
    tested = f", global {p_equals(diagnosis.global_p)}" if diagnosis.candidates_tried else ""
    line.append(f"  ({used(diagnosis)}{_friction(diagnosis)}{tested})")
    return line


def _friction(diagnosis: Diagnosis) -> str:
    """Returns the level of friction; empty where it is not known, or told beside that of a simulation."""
    told = diagnosis.level_differs or not math.isfinite(diagnosis.mu_s.value)
    return "" if told else f", {diagnosis.level} = {diagnosis.mu_s}"


def _numerics(diagnosis: Diagnosis) -> list[Text]:
    """Returns lines on the simulator's numerical artefacts."""
    return [Text(f"Numerics, not physics: {_artefact(one)}, cured by {one['cured_by']}") for one in diagnosis.numerics]


def _artefact(one: Mapping[str, Any]) -> str:
    meant = f" ({one['meant']})" if one.get("meant") else ""
    unit = {"deg": "°"}.get(one["unit"], f" {one['unit']}")
    return f"{one['id']}{meant} {rounded(one['size'], 2)}{unit}"


def _simulated(diagnosis: Diagnosis) -> list[RenderableType]:
    """Returns a table of the simulator's onsets and paths before and after, plain and robust, in held-out runs."""
    rerun = diagnosis.fit.simulator_rerun
    if not rerun:
        return []
    before, after = rerun["before"], rerun.get("after") or {}
    table = Table(box=None, pad_edge=False)
    held_out = " unseen" if rerun.get("held_out") and after else ""
    columns = (f"In {rerun['engine']}, {rerun.get('runs', '–')}{held_out} runs", "before", "with what was found")
    for column in columns if after else columns[:2]:
        table.add_column(column)
    own_before, own_after = (one.get("own_level") or {} for one in (before, after))
    for error, then, since, words in (
        (_ONSETS, before, after, ""),
        (_PATHS, before, after, ""),
        (_TURNS, before, after, ""),
        (_PATHS, own_before, own_after, f", {own_level(rerun)}"),
    ):
        if cells := _cells(error, then):
            table.add_row(error.words + words, cells, *([_cells(error, since)] if after else []))
    return [table, *([Text(f"{rerun['no_after']}.")] if rerun.get("no_after") else [])]


@dataclass(frozen=True)
class _Error:
    """An error of the simulator's, with its unit and the keys of its median and root mean square."""

    words: str
    unit: str
    keys: tuple[str, str]


_ONSETS = _Error("onset error, median and rms", "°", ("onset_median_deg", "onset_rmse_deg"))
_PATHS = _Error("path error, median and rms", " mm", ("path_median_mm", "path_rmse_mm"))
_TURNS = _Error("yaw error, median and rms", "°", ("turn_median_deg", "turn_rmse_deg"))


def _cells(error: _Error, errors: Mapping[str, Any]) -> str:
    """Returns the two figures with their standard errors; empty where there is nothing to compare."""
    se: Mapping[str, float | None] = errors.get("se") or {}
    known = [(errors[key], se.get(key)) for key in error.keys if errors.get(key) is not None]
    # A single run has an error, and nobody knows how it scatters.
    return ", ".join(_number("{}", value, math.nan if sd is None else sd) + error.unit for value, sd in known)


_WHERE: dict[Side, str] = {"recording": "recording", "simulation": "simulation", "both": "recording and simulation"}


def _effects(diagnosis: Diagnosis) -> Table:
    table = Table(box=None, pad_edge=False)
    columns = ("What", "in the", "it differs" if diagnosis.given else "probability", "verdict", "how much")
    for column in columns if diagnosis.given else (columns[0], *columns[2:]):
        table.add_column(column)
    for effect in in_order(diagnosis):
        much = _how_much(effect)
        verdict = "alike" if effect.side == "both" and effect.verdict == "not supported" else effect.verdict
        cells = [", ".join(effect.class_ids), _WHERE[effect.side], f"{effect.probability:.2f}", verdict, much]
        table.add_row(*(cells if diagnosis.given else (cells[0], *cells[2:])))
    return table


def _how_much(effect: EffectFound) -> str:
    """Gives the combinations that are identifiable, then the single numbers that are."""
    known = [f"{one.expression}: {one.known}" for one in effect.determined]
    if known and effect.is_series:  # its terms say nothing one by one
        return "; ".join(known)
    inside = known or any(not value.at_bound for value in effect.parameters.values())
    single = {name: value for name, value in effect.parameters.items() if not (inside and value.at_bound)}
    values = ", ".join(f"{read_name(name, value.unit)} = {value}" for name, value in single.items())
    # Numbers of which a combination is known lie anywhere along it, not only where their bounds end it.
    left = "alone is not determined" if known else "is at its bound"
    held = [f"{read_name(name, one.unit)} {left}" for name, one in effect.parameters.items() if name not in single]
    return "; ".join([*known, *([values] if values else []), *held])


def _fit(diagnosis: Diagnosis) -> Text:
    """Returns the fit to unseen runs before and after, in robust figures with standard errors, if there are any."""
    fit = diagnosis.fit
    parts = [
        _number(f"log score {{}} a {singular(diagnosis)}", fit.log_score_gain, fit.gain_se, sign=True),
        _number(as_expected("{}"), fit.gap_closed, fit.gap_closed_se),
        _change(fit, "onset_median_deg", "median onset error", "°"),
        _change(fit, "path_median_mm", PATH_ERROR, " mm"),
        _change(fit, "turn_median_deg", "median yaw error", "°") if fit.changes("turn_median_deg") else "",
        _change(fit, "coverage90", "90 % intervals hold", " of the onsets"),
    ]
    shown = [part for part in parts if part]
    since = ", from the simulation to what the recording has" if diagnosis.given else ""
    return Text(f"Prediction of unseen {diagnosis.counted}{since}: {'; '.join(shown) or 'there is nothing to compare'}")


def _change(fit: FitQuality, name: str, words: str, unit: str) -> str:
    before, after = (_figure(one, name) for one in (fit.before, fit.after))
    return f"{words} {before} to {after}{unit}" if before and after else ""


def _figure(quality: Quality, name: str) -> str:
    return _number("{}", getattr(quality, name), quality.se.get(name, math.nan))


def _number(words: str, value: float, se: float, *, sign: bool = False) -> str:
    """Returns the words with the number and its standard error in them; empty if there is no number."""
    if not math.isfinite(value):
        return ""
    digits = min(math.ceil(-math.log10(se)), MOST_DIGITS) if 0.0 < se < LEAST_SHOWN else 2
    number = f"{value:+.{digits}f}" if sign else f"{value:.{digits}f}"
    return words.format(f"{number} ± {se:.{digits}f}" if math.isfinite(se) else number)
