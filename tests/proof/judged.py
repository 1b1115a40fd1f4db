"""Predictions of runs that a model has not seen, in the units of physics: onsets (deg) and simulated slides (mm)."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from station.diagnosis.inference.fit import Fit
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.predict.folds import refitted
from station.diagnosis.predict.held_out import HeldOut, predicted, with_paths
from station.physics.contact import Array
from station.physics.effect import Effect


def judged(evidence: Evidence, whole: Fit, effects: Sequence[Effect], fold: Array) -> HeldOut:
    """Refits given effects without each fold (r,), and predicts it."""
    parts = refitted(evidence, whole, effects, fold)
    return with_paths(evidence, predicted(evidence, parts), parts)


def errors(held: HeldOut) -> dict[str, float]:
    """Root mean squares over the runs; nan where nothing is predicted."""
    return {"onset_deg": _rms(held.onset_error_deg), "path_mm": _rms(held.path_error_mm)}


def gain(held: HeldOut, base: HeldOut) -> dict[str, float]:
    """The mean gain of a held-out run over the plain model, in log density, with its standard error."""
    each = held.log_run - base.log_run
    each = each[np.isfinite(each)]
    if len(each) < 2:
        return {"gain": math.nan, "se": math.nan}
    return {"gain": float(each.mean()), "se": float(each.std(ddof=1) / math.sqrt(len(each)))}


def _rms(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else math.nan
