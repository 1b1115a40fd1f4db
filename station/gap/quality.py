"""How well held-out runs are predicted, before and after: each run is predicted by a fit that has not seen it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import norm
from scipy.stats import t as student

from station.gap.evidence.channel import Channel
from station.gap.evidence.evidence import Evidence
from station.gap.evidence.onsets import Onsets
from station.gap.evidence.slides import Along
from station.gap.result import FitQuality, Quality
from station.gap.statistics.fit import Fit, fit
from station.gap.statistics.noise import GAUSSIAN
from station.physics.contact import Array, Bools
from station.physics.effect import Effect

FOLDS = 5


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

    def quality(self) -> Quality:
        """The summary."""
        return Quality(
            log_score=_mean(self.log_run),
            onset_rmse_deg=math.degrees(_rms(self.onset_rad)),
            path_rmse_mm=1e3 * _rms(self.path_m),
            coverage90=_mean(self.within),
        )


def both_held_out(
    evidence: Evidence, before: Fit, after: Fit, effects: Sequence[Effect], rng: np.random.Generator
) -> tuple[HeldOut, HeldOut]:
    """The predictions of the plain model and of the one that has `effects`, over the same folds."""
    fold = rng.permutation(np.arange(evidence.runs) % FOLDS)
    plain = held_out(evidence, before, (), fold)
    return plain, held_out(evidence, after, effects, fold) if effects else plain


def compared(evidence: Evidence, before: Fit, after: Fit, both: tuple[HeldOut, HeldOut]) -> FitQuality:
    """Sums up the predictions of both."""
    plain, full = both
    used = np.isfinite(plain.log_run) & np.isfinite(full.log_run)
    gain = full.log_run[used] - plain.log_run[used]
    se = float(np.std(gain, ddof=1)) / math.sqrt(max(len(gain), 1)) if len(gain) > 1 else math.nan
    seen = (after.log_likelihood - before.log_likelihood) / max(int(used.sum()), 1)
    share = min(max(_mean(gain) / seen, 0.0), 1.0) if seen > 1e-9 else math.nan
    return FitQuality(
        before=plain.quality(),
        after=full.quality(),
        log_score_gain=_mean(gain),
        gain_se=se,
        floor_onset_deg=_floor_deg(evidence, after),
        gap_closed=share,
    )


def held_out(evidence: Evidence, whole: Fit, effects: Sequence[Effect], fold: Array) -> HeldOut:
    """Fits anew without each fold, from the whole fit as a start, and predicts it.

    What the nuisances had to bend counts here as it does in the fit, each run's share of it: a plain model that reads
    all onsets late by seven times what is plausible predicts well, and is not right.
    """
    runs = evidence.runs
    log_run, onset, within, path, rank = (np.full(runs, np.nan) for _ in range(5))
    for number in range(FOLDS):
        left_out: Bools = fold == number
        part = fit(evidence, whole.model, effects, noise=whole.noise, runs=~left_out)
        log_run[left_out] = part.log_run[left_out] + part.log_prior / runs
        for channel in evidence.channels:
            if isinstance(channel, Onsets):
                _onsets(channel, part, left_out, onset=onset, within=within, rank=rank)
            elif isinstance(channel, Along):
                _paths(channel, part, left_out, path, drawn=_drawn(evidence, part))
    present = np.zeros(runs, dtype=np.bool_)
    for channel in evidence.channels:
        present[channel.rows.run] = True
    log_run[~present] = np.nan
    return HeldOut(log_run, onset, within, path, rank)


def _onsets(channel: Onsets, part: Fit, left_out: Bools, *, onset: Array, within: Array, rank: Array) -> None:
    rows = channel.rows
    residual, tilt = channel.residual(part.model), channel.angle_rad()
    chosen = left_out[rows.run] & ~rows.limit
    onset[rows.run[chosen]] = (residual * np.sin(tilt) * np.cos(tilt))[chosen]
    spread = np.sqrt(part.noise.scatter**2 + rows.sigma**2 + channel.shaking(part.model) ** 2)
    tail = part.noise.tail[channel.name]
    law: Any = norm if tail >= GAUSSIAN else student(tail)
    pull = residual / spread
    within[rows.run[chosen]] = (np.abs(pull) <= float(law.ppf(0.95)))[chosen]
    rank[rows.run[chosen]] = law.cdf(pull)[chosen]


def _drawn(evidence: Evidence, part: Fit) -> Array:
    """What each run's onset (r,) leads one to expect of its slide: the friction that both share."""
    expected = np.full(evidence.runs, np.nan if evidence.channel("onset") else 0.0)
    channel = evidence.channel("onset")
    if channel is not None and part.noise.scatter > 0:
        share = part.noise.friction**2 / part.noise.scatter**2
        known = ~channel.rows.limit
        expected[channel.rows.run[known]] = share * channel.residual(part.model)[known]
    return expected


def _paths(channel: Along, part: Fit, left_out: Bools, path: Array, *, drawn: Array) -> None:
    """Root mean square over each slide of where the unexplained force moves the block, its onset being known."""
    rows = channel.rows
    lost = (channel.residual(part.model) - drawn[rows.run]) * channel.friction_m_s2()
    known = np.isfinite(drawn[rows.run])  # without an onset of its own a slide's level is anybody's guess
    for run in np.unique(rows.run[left_out[rows.run] & known]):
        mine = np.flatnonzero(rows.run == run)
        seconds = (rows.to_ns[mine] - rows.from_ns[mine]) * 1e-9
        speed = np.cumsum(lost[mine] * seconds)
        place = np.cumsum((speed - 0.5 * lost[mine] * seconds) * seconds)
        path[run] = math.sqrt(float(np.mean(place**2)))


def _floor_deg(evidence: Evidence, after: Fit) -> float:
    """The scatter between equal runs, as an angle."""
    channel: Channel | None = evidence.channel("onset")
    if not isinstance(channel, Onsets):
        return math.nan
    tilt = channel.angle_rad()
    return math.degrees(after.noise.scatter * float(np.sqrt(np.mean((np.sin(tilt) * np.cos(tilt)) ** 2))))


def _mean(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else math.nan


def _rms(values: Array) -> float:
    known = values[np.isfinite(values)]
    return math.sqrt(float(np.mean(known**2))) if len(known) else math.nan
