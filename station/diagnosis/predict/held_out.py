"""Predictions of runs that a fit has not seen: their log density, their onsets, and their simulated slides."""

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
from station.diagnosis.predict.resimulated import slide_errors
from station.diagnosis.predict.unseen import unseen_log_run
from station.physics.contact import Array, Bools
from station.physics.effect import Effect

Parts = Sequence[tuple[Bools, Fit]]
"""Fits, each with a mask (r,) of the runs that it has not seen."""


UPPER = 0.95
"""The upper quantile of a central 90 % interval."""


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Predictions of every run (r,) by fits without it: log density (nat), onset error (rad), slide errors (m, rad).

    `within` is 1 if the onset lies in its 90 % interval; `rank` is the share of the predicted distribution below the
    recorded onset, which is uniform where the spread is right. A figure that a run lacks is nan.
    """

    log_run: Array
    onset_rad: Array
    within: Array
    path_m: Array
    turn_rad: Array
    rank: Array

    @property
    def onset_error_deg(self) -> Array:
        """The onsets' errors (r,), recorded minus predicted, in degrees."""
        return np.degrees(self.onset_rad)

    @property
    def path_error_mm(self) -> Array:
        """The slides' errors (r,), mm."""
        return 1e3 * self.path_m

    @property
    def turn_error_deg(self) -> Array:
        """The errors (r,) of the blocks' yaw in their slides, in degrees."""
        return np.degrees(self.turn_rad)


def held_out(evidence: Evidence, whole: Fit, effects: Sequence[Effect], fold: Array) -> HeldOut:
    """Refits given effects without each fold (r,), from the whole fit as a start, and predicts it; slides are nan."""
    return predicted(evidence, refitted(evidence, whole, effects, fold))


def predicted(evidence: Evidence, parts: Parts) -> HeldOut:
    """Returns the predictions of runs by fits that have not seen them; their slides are nan (see `with_paths`).

    The log prior of the nuisances counts here as it does in the fit, each run's share of it: a plain model that reads
    all onsets late by seven times what is plausible predicts well, and is not right.
    """
    runs = evidence.runs
    log_run, onset, within, path, turn, rank = (np.full(runs, np.nan) for _ in range(6))
    for left_out, part in parts:
        log_run[left_out] = unseen_log_run(evidence, part)[left_out] + part.log_prior / runs
        channel = evidence.onsets
        if isinstance(channel, Onsets):
            _onsets(channel, part, left_out, onset=onset, within=within, rank=rank)
    present = np.zeros(runs, dtype=np.bool_)
    for channel in evidence.channels:
        present[channel.rows.run] = True
    log_run[~present] = np.nan
    return HeldOut(log_run, onset, within, path, turn, rank)


def with_paths(evidence: Evidence, held: HeldOut, parts: Parts) -> HeldOut:
    """Returns the predictions with the slides simulated again by fits that have not seen them."""
    path, turn = np.full((2, evidence.runs), np.nan)
    for left_out, part in parts:
        found = slide_errors(evidence, part.model, left_out, run_effects=_run_effects(evidence, part))
        path[left_out], turn[left_out] = found.path_m[left_out], found.turn_rad[left_out]
    return replace(held, path_m=path, turn_rad=turn)


def _onsets(channel: Onsets, part: Fit, left_out: Bools, *, onset: Array, within: Array, rank: Array) -> None:
    rows = channel.rows
    residual, tilt = channel.residual(part.model), channel.angle_rad()
    chosen = left_out[rows.run] & ~rows.limit
    onset[rows.run[chosen]] = (residual * np.sin(tilt) * np.cos(tilt))[chosen]
    spread = np.sqrt(part.noise.scatter**2 + part.noise.of_reading(channel) + channel.shaking(part.model) ** 2)
    tail = part.noise.tail[channel.name]
    law: Any = norm if tail >= thresholds.GAUSSIAN else student(tail)
    pull = residual / spread
    within[rows.run[chosen]] = (np.abs(pull) <= float(law.ppf(UPPER)))[chosen]
    rank[rows.run[chosen]] = law.cdf(pull)[chosen]


def _run_effects(evidence: Evidence, part: Fit) -> Array:
    """Returns the expected log (r,) of the factor on the model's friction in each run's slide.

    It is nan where the onset is unknown.

    It is that by which the friction at the recorded onset differs from the model's. The onset's residual is not: with a
    tilt that is read a degree low, a run whose friction is 1.3 times the others' has a residual of 1.32.
    """
    channel = evidence.onsets
    if not isinstance(channel, Onsets):
        return np.zeros(evidence.runs)
    # The difference of onset and slide tells what they do not share, with the error of the reading in it.
    shown = part.noise.scatter**2 + channel.shaking(part.model) ** 2
    share, known = np.full(evidence.runs, np.nan), ~channel.rows.limit & (shown > 0)
    share[channel.rows.run[known]] = part.noise.friction**2 / shown[known]
    return share * channel.run_effects(part.model, evidence.runs)[0]
