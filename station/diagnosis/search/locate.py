"""The places where residuals stand out, by rank, with the runs and stretches that stand out most, in a sentence."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.observations.covariates import TITLES
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.result import Located, Stretch, Tested, rounded
from station.diagnosis.search.places import EVERYWHERE, Place
from station.diagnosis.search.search import Stage
from station.physics.contact import Array, Bools
from station.physics.model import Model

MOST_PLACES = 12
MOST_WINDOWS = 20
MOST_RUNS = 60
STANDS_OUT = 0.7
"""A row stands out if the smooth part's size there is above this quantile."""

NINE_TENTHS = (0.05, 0.95)
"""The quantiles of a smooth part between which a change is told: from nearly the least to nearly the most of it."""

BINS = 10

READ_RESIDUALS_IN = {
    "m": (1e3, "mm"),
    "rad": (math.degrees(1.0), "°"),
    "rad/s²": (math.degrees(1.0), "°/s²"),
    "relative friction": (100.0, "%"),
    "1": (100.0, "%"),
}
"""The factor and the unit in which people read a residual of another unit."""


def located(evidence: Evidence, stages: Sequence[Stage], *, against: Model | None = None) -> tuple[Located, ...]:
    """Returns all places that stand out beyond chance, each from the stage with the smallest p.

    Their sizes are what the stage's model leaves, or what the recording differs by from the model `against`.
    """
    best: dict[tuple[str, str], Located] = {}
    for number, stage in enumerate(stages, start=1):
        for place in _of_stage(evidence, stage, number, against or stage.before.model):
            key = (place.channel, place.covariate)
            if key not in best or place.p < best[key].p:
                best[key] = place
    return tuple(sorted(best.values(), key=lambda place: (place.p, -place.effect_size))[:MOST_PLACES])


def _of_stage(evidence: Evidence, stage: Stage, number: int, model: Model) -> Iterator[Located]:
    for place, p, tested in tested_places(stage):
        if p < thresholds.LEVEL:
            yield replace(_located(evidence, model, place, p), stage=number, tested=tested)


def tested_places(stage: Stage) -> Iterator[tuple[Place, float, Tested]]:
    """Yields a stage's places, each with its p and the test that has it, which is the one of two with the smaller p.

    One is of the place's channel alone; the other, of friction that onset and slide share, is of a smooth term beside
    their levels. Both are corrected for the whole search of the stage.
    """
    for candidate in stage.places:
        place, alone = candidate.place, float(stage.calibration.corrected(candidate.p))
        if place is None:
            continue
        known = stage.shared.get((place.covariate, place.phase), 1.0) if place.channel.shares_friction else 1.0
        shared = float(stage.calibration.corrected(known))
        yield (place, shared, "friction") if shared < alone else (place, alone, "channel")


def _located(evidence: Evidence, model: Model, place: Place, p: float) -> Located:
    channel, rows = place.channel, place.channel.rows
    residual, smooth, size = smooth_part(model, place)
    known = ~rows.limit
    out = np.flatnonzero(np.abs(smooth) >= np.quantile(np.abs(smooth), STANDS_OUT))
    ranked = out[np.argsort(-np.abs(smooth[out]), kind="stable")]
    runs = list(dict.fromkeys(evidence.run_number[rows.run[ranked]].astype(int).tolist()))[:MOST_RUNS]
    windows = tuple(
        Stretch(run=int(evidence.run_number[rows.run[row]]), from_ns=int(rows.from_ns[row]), to_ns=int(rows.to_ns[row]))
        for row in ranked[:MOST_WINDOWS].tolist()
    )
    return Located(
        phase=channel.phase,
        covariate=place.covariate,
        channel=channel.name,
        effect_size=size,
        p=p,
        runs=tuple(sorted(runs)),
        windows=windows,
        summary=summary_of(model, place),
        curve=_curve(rows.covariates.get(place.covariate), residual, known),
    )


def summary_of(model: Model, place: Place) -> str:
    """Returns one sentence that says on what a place's residuals depend, and how strongly."""
    residual, smooth, _ = smooth_part(model, place)
    channel, what = place.channel, place.channel.title
    if place.covariate == EVERYWHERE:
        middle = _middle(residual)  # friction's residuals are logarithms
        amount = _amount(math.expm1(middle) if channel.shares_friction else middle, channel.unit)
        return f"{channel.phase}: {what} is off by {amount} throughout"
    title = TITLES.get(place.covariate, place.covariate)
    low, high = np.quantile(smooth, NINE_TENTHS).tolist()
    change = math.expm1(high - low) if channel.shares_friction else high - low
    return f"{channel.phase}: {what} changes by about {_amount(change, channel.unit)} with the {title}"


def smooth_part(model: Model, place: Place) -> tuple[Array, Array, float]:
    """Returns a place's residuals (n,), their smooth part over the covariate (n,), and the ratio of their rms (≤ 1)."""
    channel, rows = place.channel, place.channel.rows
    everywhere, known = place.covariate == EVERYWHERE, ~rows.limit
    residual = whole = np.where(known, channel.residual(model), 0.0)
    if everywhere:
        residual = np.where(known, channel.off(model), 0.0)
    else:
        residual = whole = residual - np.median(residual[known])
    weight = 1.0 / np.maximum(rows.sigma, np.median(rows.sigma) * 0.1)
    if channel.shares_friction:
        weight = np.ones(len(rows))
    smooth = place.basis @ np.linalg.lstsq(place.basis * weight[:, None], residual * weight, rcond=None)[0]
    size = float(np.sqrt(np.mean(smooth**2)) / max(np.sqrt(np.mean(whole**2)), 1e-12))
    return residual, smooth, min(size, 1.0)


def _amount(value: float, unit: str) -> str:
    factor, read = READ_RESIDUALS_IN.get(unit, (1.0, unit))
    return f"{rounded(factor * value, 3 if unit == 'm' else 2)}{'' if read == '°' else ' '}{read}"


def _curve(covariate: Array | None, residual: Array, known: Bools) -> tuple[tuple[float, float, float], ...]:
    """Returns the means of the residual in bins of the covariate, with standard errors."""
    if covariate is None:
        return ()
    good = known & np.isfinite(covariate)
    values, wanted = covariate[good], residual[good]
    if len(values) < BINS:
        return ()
    edges = np.unique(np.quantile(values, np.linspace(0, 1, BINS + 1)))
    if len(edges) < 3:
        return ()
    number = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
    points = list[tuple[float, float, float]]()
    for one in range(len(edges) - 1):
        mine = wanted[number == one]
        if len(mine) > 1:
            error = float(np.std(mine, ddof=1)) / float(np.sqrt(len(mine)))
            points.append((float(values[number == one].mean()), float(mine.mean()), error))
    return tuple(points)


def _middle(values: Array) -> float:
    return float(np.median(values))
