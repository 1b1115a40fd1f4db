"""A found place is judged by run × phase × covariate, as the area under a ROC curve.

Generator and tool have words of their own for phases and covariates. A cell (run, phase, covariate) is scored by the
tool with −log10 p of its located place, in full for the runs that it lists there and half for the others. The places
that the key lists for an effect are one place by several names (a speed law shows against speed and against time), and
count by the best of them.

A generator that records by how much an effect acted in each phase of each run, and no covariate, is scored by run ×
phase: a cell by the surest of the tool's places in that phase. Apart from that, an effect that the tool names is scored
by what the tool says of its size in that run and phase.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from scipy.stats import rankdata

from station.physics.contact import Array
from tests.proof.key import Concealed
from tests.proof.said import Said, number

PHASES = {"camera at rest": "rest", "pre-slip": "pre-slip", "onset": "onset", "slide": "slide", "stop": "slide"}
"""The tool's and the generator's phases; a stop is the end of a slide, and the tool's slides have it."""

COVARIATES: Mapping[str, str] = {
    "slide_time": "time",
    "slide_to_grain": "direction",
    "slide_to_block": "yaw",
    "camera_place": "position",
    "x": "position",
    "y": "position",
    "ahead": "position",
    "previous_slide": "previous_length",
    "turned": "previous_direction",
    "step_time": "step",
    "slides_since_handled": "run",
    "since_handled": "run",
}
"""One word for what is the same; other words stand for themselves."""

EVERYWHERE = "all"
"""A constant offset of an image channel: it says the phase and no covariate, and counts for every one of that phase."""

PHASES_ALL = ("rest", "pre-slip", "onset", "slide")
COVARIATES_ALL = (
    "direction", "yaw", "position", "speed", "time", "tilt", "tilt_rate", "dwell", "run", "load", "humidity", "step",
    "temperature", "previous_direction", "previous_length",
)  # fmt: skip
LISTED, OTHER_RUNS = 1.0, 0.5
STRONG, WEAK = 0.5, 0.25
"""Runs with at least this share of the largest shift must be found; those below `WEAK` must not."""

Cell = tuple[str, str]
RunPhase = tuple[str, int]


def cell(phase: str, covariate: str) -> Cell:
    """A place in common words."""
    return PHASES.get(phase, phase), COVARIATES.get(covariate, covariate)


def found_places(said: Said) -> dict[Cell, Mapping[str, Any]]:
    """The tool's located places by cell, the surest of each."""
    found: dict[Cell, Mapping[str, Any]] = {}
    for place in said.answer.get("located", ()):
        phase, covariate = cell(place["phase"], place["covariate"])
        for name in COVARIATES_ALL if covariate == EVERYWHERE else (covariate,):
            known = found.get((phase, name))
            if known is None or number(place["p"]) < number(known["p"]):
                found[phase, name] = place
    return found


def truly(effect: Concealed) -> frozenset[Cell]:
    """The effect's places in common words."""
    return frozenset(cell(phase, covariate) for phase, covariate in effect.where)


def place_right(said: Said, effect: Concealed) -> bool:
    """True if any of the effect's places is among the located ones; by the phases alone where no covariate is known."""
    found = found_places(said)
    if effect.acted:
        largest = max(effect.acted.values())
        phases = {phase for (phase, _), size in effect.acted.items() if size >= STRONG * largest}
        return bool(phases & {phase for phase, _ in found})
    return bool(truly(effect) & found.keys())


def place_auc(said: Said, effect: Concealed, *, others: Iterable[Concealed] = ()) -> float:
    """The area under the curve of one effect's case; nan if the key names no place.

    What `others`, concealed in the same case, show is not held against it.
    """
    if effect.acted:
        return _auc_by_phase(said, effect, others)
    where = truly(effect)
    if not where:
        return math.nan
    excused = {place for other in others for place in truly(other)} - where
    found = found_places(said)
    signs = _signs(effect)
    runs = sorted(signs)
    largest = max(signs.values(), default=0.0)
    strong = [run for run in runs if signs[run] >= STRONG * largest]
    weak = [run for run in runs if signs[run] < WEAK * largest]
    positive = [max(_score(found, place, run) for place in where) for run in strong]
    negative = [max(_score(found, place, run) for place in where) for run in weak]
    negative += [
        _score(found, (phase, covariate), run)
        for phase in PHASES_ALL
        for covariate in COVARIATES_ALL
        if (phase, covariate) not in where and (phase, covariate) not in excused
        for run in runs
    ]
    return auc(positive, negative)


def acting_auc(said: Said, effect: Concealed) -> float:
    """The area under the curve of what the tool says of a rightly named effect's sizes by run and phase.

    0.5 without that name: nothing is said of it. It is nan where the generator has no record.
    """
    if not effect.acted:
        return math.nan
    nothing: Mapping[str, Any] = {}
    named = next((one for one in said.claimed if effect.right & set(one["class"])), nothing)
    sizes: dict[RunPhase, float] = {}
    for one in named.get("acting", ()):
        phase = cell(one["phase"], "")[0]
        for run, size in zip(one["runs"], one["sizes"], strict=True):
            sizes[phase, run] = max(size, sizes.get((phase, run), 0.0))
    return _auc_of_cells(effect, lambda at: sizes.get(at, 0.0))


def _auc_by_phase(said: Said, effect: Concealed, others: Iterable[Concealed]) -> float:
    found = found_places(said)
    excused = {
        cell for other in others for cell, value in other.acted.items() if value >= WEAK * max(other.acted.values())
    }

    def score(cell: RunPhase) -> float:
        phase, run = cell
        return max((_score(found, place, run) for place in found if place[0] == phase), default=0.0)

    return _auc_of_cells(effect, score, excused=excused)


def _auc_of_cells(effect: Concealed, score: Callable[[RunPhase], float], *, excused: Container[RunPhase] = ()) -> float:
    """Cells (phase, run) in which an effect acted strongly, against those in which it hardly did.

    The record is in units of what each phase shows: where an effect acts by more than a unit it shows, even if it shows
    twenty times more elsewhere, or in one run that slipped early.
    """
    largest = max(effect.acted.values())
    strongly, hardly = min(STRONG * largest, 1.0), WEAK * min(largest, 1.0)
    positive = [score(cell) for cell, size in effect.acted.items() if size >= strongly]
    negative = [score(cell) for cell, size in effect.acted.items() if size < hardly and cell not in excused]
    return auc(positive, negative)


def _signs(effect: Concealed) -> dict[int, float]:
    runs = effect.onset_signs.keys() | effect.path_signs.keys()
    return {run: max(abs(effect.onset_signs.get(run, 0.0)), abs(effect.path_signs.get(run, 0.0))) for run in runs}


def _score(found: Mapping[Cell, Mapping[str, Any]], place: Cell, run: int) -> float:
    located = found.get(place)
    if located is None:
        return 0.0
    sure = -math.log10(max(number(located["p"]), 1e-12))
    return sure * (LISTED if run in located["runs"] else OTHER_RUNS)


def auc(positive: Sequence[float], negative: Sequence[float]) -> float:
    """Returns how often a positive is scored higher than a negative, both drawn at random; ties are half."""
    if not positive or not negative:
        return math.nan
    ranks: Array = rankdata(np.concatenate([positive, negative]))
    count = len(positive)
    return float((ranks[:count].sum() - count * (count + 1) / 2) / (count * len(negative)))
