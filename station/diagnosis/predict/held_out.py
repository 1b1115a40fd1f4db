"""What fits say of runs that they have not seen: their likelihood, their onsets, and where their slides lead."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.stats import norm
from scipy.stats import t as student

from station.diagnosis import thresholds
from station.diagnosis.inference.fit import Fit
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.onsets import Onsets
from station.diagnosis.predict.folds import refitted
from station.diagnosis.predict.resimulated import path_errors
from station.physics.contact import Array, Bools
from station.physics.effect import Effect

Parts = Sequence[tuple[Bools, Fit]]
"""Fits, each with the runs (r,) that it has not seen."""


UPPER = 0.95
"""The quantile at which the central 90 % end."""


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Of every run (r,), by fits without it: log density, onset error (rad), whether within 90 %; path errors (m).

    `rank` is the share of the predicted distribution below the recorded onset: uniform where the spread is right.
    """

    log_run: Array
    onset_rad: Array
    within: Array
    path_m: Array
    rank: Array


def held_out(evidence: Evidence, whole: Fit, effects: Sequence[Effect], fold: Array) -> HeldOut:
    """Fits given effects anew without each fold (r,), from the whole fit as a start, and predicts it; no paths."""
    return predicted(evidence, refitted(evidence, whole, effects, fold))


def predicted(evidence: Evidence, parts: Parts) -> HeldOut:
    """What fits say of the runs that they have not seen; their paths are nan (see `with_paths`).

    What the nuisances had to bend counts here as it does in the fit, each run's share of it: a plain model that reads
    all onsets late by seven times what is plausible predicts well, and is not right.
    """
    runs = evidence.runs
    log_run, onset, within, path, rank = (np.full(runs, np.nan) for _ in range(5))
    for left_out, part in parts:
        log_run[left_out] = part.log_run[left_out] + part.log_prior / runs
        channel = evidence.channel("onset")
        if isinstance(channel, Onsets):
            _onsets(channel, part, left_out, onset=onset, within=within, rank=rank)
    present = np.zeros(runs, dtype=np.bool_)
    for channel in evidence.channels:
        present[channel.rows.run] = True
    log_run[~present] = np.nan
    return HeldOut(log_run, onset, within, path, rank)


def with_paths(evidence: Evidence, held: HeldOut, parts: Parts) -> HeldOut:
    """The same with the slides simulated again by fits that have not seen them."""
    path = np.full(evidence.runs, np.nan)
    for left_out, part in parts:
        path[left_out] = path_errors(evidence, part.model, left_out, drawn=_drawn(evidence, part))[left_out]
    return replace(held, path_m=path)


def _onsets(channel: Onsets, part: Fit, left_out: Bools, *, onset: Array, within: Array, rank: Array) -> None:
    rows = channel.rows
    residual, tilt = channel.residual(part.model), channel.angle_rad()
    chosen = left_out[rows.run] & ~rows.limit
    onset[rows.run[chosen]] = (residual * np.sin(tilt) * np.cos(tilt))[chosen]
    spread = np.sqrt(part.noise.scatter**2 + rows.sigma**2 + channel.shaking(part.model) ** 2)
    tail = part.noise.tail[channel.name]
    law: Any = norm if tail >= thresholds.GAUSSIAN else student(tail)
    pull = residual / spread
    within[rows.run[chosen]] = (np.abs(pull) <= float(law.ppf(UPPER)))[chosen]
    rank[rows.run[chosen]] = law.cdf(pull)[chosen]


def _drawn(evidence: Evidence, part: Fit) -> Array:
    """What each run's onset (r,) leads one to expect of its slide: the friction that both share."""
    channel = evidence.channel("onset")
    expected = np.full(evidence.runs, 0.0 if channel is None else np.nan)
    if channel is not None and part.noise.scatter > 0:
        share = part.noise.friction**2 / part.noise.scatter**2
        known = ~channel.rows.limit
        expected[channel.rows.run[known]] = share * channel.residual(part.model)[known]
    return expected
