"""The summary for the terminal: what a tired person understands in ten seconds."""

from __future__ import annotations

import math

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from station.diagnosis.result import Diagnosis, EffectFound, FitQuality, Quality, Value

MOST_PLACES = 4
_COLOUR = {"supported": "green", "indistinguishable": "yellow", "not supported": "cyan", "untestable": "red"}


def summary(diagnosis: Diagnosis) -> RenderableType:
    """Verdict first, then what, where, how much better, and what to do next."""
    parts: list[RenderableType] = [_headline(diagnosis)]
    if diagnosis.verdict == "untestable":
        return Group(*parts, *(Text(f"  {note}") for note in diagnosis.notes))
    if diagnosis.effects:
        parts.append(_effects(diagnosis))
    if diagnosis.located:
        parts.append(Text("Where:"))
        parts += [Text(f"  {place.summary} (p = {place.p:.2g})") for place in diagnosis.located[:MOST_PLACES]]
    parts.append(_fit(diagnosis))
    parts += _simulated(diagnosis)
    if diagnosis.next_experiment is not None:
        parts.append(Text(f"Next: {diagnosis.next_experiment.runs} runs; {diagnosis.next_experiment.why}"))
    if diagnosis.untestable:
        parts.append(Text(f"Untestable with this recording: {', '.join(sorted(diagnosis.untestable))}"))
    parts += [Text(f"Note: {note}") for note in diagnosis.notes]
    return Group(*parts)


def _headline(diagnosis: Diagnosis) -> Text:
    line = Text()
    line.append(f"{diagnosis.recording}: ")
    line.append(_sentence(diagnosis), style=f"bold {_COLOUR[diagnosis.verdict]}")
    line.append(f"  ({diagnosis.used_runs} of {diagnosis.total_runs} runs, global p = {diagnosis.global_p:.2g})")
    return line


def _sentence(diagnosis: Diagnosis) -> str:
    if diagnosis.verdict == "untestable":
        return "nothing can be tested with this recording"
    if diagnosis.verdict == "not supported":
        return "no missing effect is supported; the plain model explains this recording"
    names = [_name(effect) for effect in diagnosis.effects if effect.verdict != "not supported"]
    return "left out of the simulation: " + " and ".join(names)


def _simulated(diagnosis: Diagnosis) -> list[Text]:
    """What the user's simulator's numerics do, and how it fares before and after."""
    lines = [
        Text(f"Numerics, not physics: {one['id']} {one['size']:.2g} {one['unit']}, cured by {one['cured_by']}")
        for one in diagnosis.numerics
    ]
    rerun = diagnosis.fit.simulator_rerun
    if rerun:
        levels = [rerun[when].get("own_level", rerun[when]) for when in ("before", "after") if rerun.get(when)]
        figures = [
            " to ".join("–" if (one := level[key]) is None else f"{one:.2f}" for level in levels) for key in _RERUN
        ]
        lines.append(Text(f"In {rerun['engine']}, at each run's own level: onset {figures[0]}°, path {figures[1]} mm"))
    return lines


_RERUN = ("onset_rmse_deg", "path_rmse_mm")


def _name(effect: EffectFound) -> str:
    return effect.title if len(effect.class_ids) < 2 else f"one of {', '.join(effect.class_ids)}"


def _effects(diagnosis: Diagnosis) -> Table:
    table = Table(box=None, pad_edge=False)
    for column in ("What", "probability", "verdict", "how much"):
        table.add_column(column)
    for effect in diagnosis.effects:
        values = ", ".join(f"{name} = {_value(value)}" for name, value in effect.parameters.items())
        known = (Value(value=one.value, sd=one.sd, unit=one.unit) for one in effect.determined)
        values += "".join(
            f"; {one.expression}: {_value(value)}" for one, value in zip(effect.determined, known, strict=True)
        )
        table.add_row(", ".join(effect.class_ids), f"{effect.probability:.2f}", effect.verdict, values)
    return table


def _value(value: Value) -> str:
    unit = ("" if value.unit == "1" else f" {value.unit}") + (" (at its bound)" if value.at_bound else "")
    if not math.isfinite(value.sd) or value.sd == 0:
        return f"{value.value:.3g}{unit}"
    digits = max(0, 1 - math.floor(math.log10(value.sd)))
    return f"{value.value:.{digits}f} ± {value.sd:.{digits}f}{unit}"


def _fit(diagnosis: Diagnosis) -> Text:
    """Before and after on unseen runs: robust figures, with standard errors; what the recording lacks is left out."""
    fit = diagnosis.fit
    parts = [
        _number("log score {} a run", fit.log_score_gain, fit.gain_se, sign=True),
        _number("closes {} of what it could gain", fit.gap_closed, fit.gap_closed_se),
        _change(fit, "onset_median_deg", "median onset error", "°"),
        _change(fit, "path_median_mm", "median error of simulated slides", " mm"),
        _change(fit, "coverage90", "90 % intervals hold", " of the onsets"),
    ]
    told = [part for part in parts if part]
    return Text("Prediction of unseen runs: " + ("; ".join(told) if told else "there is nothing to compare"))


def _change(fit: FitQuality, name: str, words: str, unit: str) -> str:
    before, after = (_figure(one, name) for one in (fit.before, fit.after))
    return f"{words} {before} to {after}{unit}" if before and after else ""


def _figure(quality: Quality, name: str) -> str:
    return _number("{}", getattr(quality, name), quality.se.get(name, math.nan))


def _number(words: str, value: float, se: float, *, sign: bool = False) -> str:
    """The words with the number and its standard error in it; nothing where there is no number."""
    if not math.isfinite(value):
        return ""
    told = f"{value:+.2f}" if sign else f"{value:.2f}"
    return words.format(f"{told} ± {se:.2f}" if math.isfinite(se) else told)
