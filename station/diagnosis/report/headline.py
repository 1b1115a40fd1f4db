"""The report's first lines: the answer for somebody who reads nothing else."""

from __future__ import annotations

import math
from html import escape

from station.diagnosis.report.html import number, p_equals
from station.diagnosis.report.sentences import (
    PATH_ERROR,
    claimed_effects,
    left_out,
    next_lines,
    sentence,
    set_differently,
    singular,
    used,
)
from station.diagnosis.result import Diagnosis
from station.pages.pieces import paragraph

_CLASS = {"supported": "yes", "indistinguishable": "maybe", "not supported": "no", "untestable": "cannot"}


def headline(diagnosis: Diagnosis) -> str:
    """Returns the verdict as a sentence, then its probability, place, improvement and next step."""
    sentences = (_sure(diagnosis), _left_out(diagnosis), _where(diagnosis), _better(diagnosis), _next(diagnosis))
    lines = [*set_differently(diagnosis), *sentences]
    items = "".join(f"<li>{escape(line)}</li>" for line in lines if line)
    kind, said = _CLASS[diagnosis.verdict], escape(sentence(diagnosis))
    return f'<p class="verdict {kind}">{said}</p><ul class="short">{items}</ul>'


def _sure(diagnosis: Diagnosis) -> str:
    if diagnosis.verdict == "untestable":
        return ""
    chances = ", ".join(f"{', '.join(one.class_ids)}: {one.probability:.2f}" for one in diagnosis.effects)
    probabilities = f"; probabilities: {chances}" if chances else ""
    baseline = "given simulation" if diagnosis.given else "plain model"
    return (
        f"{used(diagnosis)} could be used. If the {baseline} were right, chance alone would differ as much with "
        f"{p_equals(diagnosis.global_p)}{probabilities}."
    )


def _left_out(diagnosis: Diagnosis) -> str:
    return f"{words}." if (words := left_out(diagnosis)) else ""


def _where(diagnosis: Diagnosis) -> str:
    return f"Clearest residual structure: {diagnosis.located[0].summary}." if diagnosis.located else ""


def _better(diagnosis: Diagnosis) -> str:
    fit = diagnosis.fit
    if not claimed_effects(diagnosis) or not math.isfinite(fit.log_score_gain):
        return ""
    changes = [
        _change("the median onset error", fit.before.onset_median_deg, fit.after.onset_median_deg, "°"),
        _change(f"the {PATH_ERROR}", fit.before.path_median_mm, fit.after.path_median_mm, " mm"),
    ]
    if fit.changes("turn_median_deg"):
        changes.append(_change("the median yaw error", fit.before.turn_median_deg, fit.after.turn_median_deg, "°"))
    if changes[0] and math.isfinite(fit.floor_onset_deg):
        changes[0] += f" (root mean square between equal {diagnosis.counted}: {number(fit.floor_onset_deg)}°)"
    gain = f"{number(fit.log_score_gain, sign=True)} ± {number(fit.gain_se)}"
    changes.append(f"the log score a {singular(diagnosis)} changes by {gain}")
    since = ", from the simulation to what the recording has" if diagnosis.given else ""
    return (
        f"On {diagnosis.counted} that the fit has not seen{since}, {', '.join(change for change in changes if change)}."
    )


def _change(name: str, before: float, after: float, unit: str) -> str:
    """Returns a phrase about how an error changes; empty where the recording has none."""
    if not (math.isfinite(before) and math.isfinite(after)):
        return ""
    first, last = f"{number(before)}{unit}", f"{number(after)}{unit}"
    return f"{name} stays at {first}" if first == last else f"{name} goes from {first} to {last}"


def _next(diagnosis: Diagnosis) -> str:
    return next_lines(diagnosis)[0] if diagnosis.next_experiment is not None else ""


def about(diagnosis: Diagnosis) -> str:
    """Returns the line that names the recording."""
    return paragraph(f"Recording: {diagnosis.recording or 'signals in memory'}", kind="about")
