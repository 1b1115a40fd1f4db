"""The quality of the predictions of unseen runs, before and after, and what each name adds to it."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from station.diagnosis.inference.ceiling import expected_log_run
from station.diagnosis.inference.fit import Fit
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.onsets import Onsets
from station.diagnosis.predict.folds import Fold, dropped
from station.diagnosis.predict.held_out import HeldOut, Parts, predicted, with_paths
from station.diagnosis.result import FitQuality, HeldOutGain, Quality, Value
from station.diagnosis.search.posterior import called
from station.physics.contact import Array
from station.simulators import figures

Classes = Mapping[str, Collection[str]]
"""Ids of what was found in all runs, each with the ids that cannot be told from it."""


@dataclass(frozen=True, eq=False)
class Sifted:
    """The folds without the names that do not improve the prediction of unseen runs, and what each name adds.

    `before` and `after` are the predictions of the plain model, and of what is left of each fold's model.
    """

    folds: tuple[Fold, ...]
    gains: Mapping[str, HeldOutGain]
    before: HeldOut
    after: HeldOut


def sifted(evidence: Evidence, folds: Sequence[Fold], classes: Classes) -> Sifted:
    """Removes the names that add nothing, the least first: of two that replace each other one stays."""
    before = _held(evidence, [(fold.left_out, fold.before) for fold in folds])
    after = _held(evidence, [(fold.left_out, fold.after) for fold in folds]) if _named(folds) else before
    gains, left = dict[str, HeldOutGain](), dict(classes)
    while left:
        without = {name: _without(evidence, folds, {called(name), *alike}) for name, alike in left.items()}
        each = {name: _adds(after, others, folds, {called(name), *left[name]}) for name, others in without.items()}
        gains |= each
        name = min(left, key=lambda name: each[name].gain.value - each[name].gain.sd)
        if each[name].real:
            break
        alike, after = {called(name), *left.pop(name)}, without[name]
        folds = [fold if (its := _one_of(fold, alike)) is None else dropped(evidence, fold, its) for fold in folds]
    return Sifted(tuple(folds), gains, before, after if _named(folds) else before)


def of_folds(evidence: Evidence, folds: Sequence[Fold]) -> Sifted:
    """Returns the predictions of both models of the folds as they are, without asking what each name adds."""
    before, after = (
        _held(evidence, [(fold.left_out, getattr(fold, when)) for fold in folds]) for when in ("before", "after")
    )
    return Sifted(tuple(folds), {}, before, after)


def _named(folds: Sequence[Fold]) -> bool:
    return any(fold.named for fold in folds)


def _held(evidence: Evidence, parts: Parts) -> HeldOut:
    return with_paths(evidence, predicted(evidence, parts), parts)


def compared(evidence: Evidence, sift: Sifted, after: Fit) -> FitQuality:
    """Returns the quality of both predictions; `after` is the model that all runs together led to."""
    folds, plain, full = sift.folds, sift.before, sift.after
    gain = _mean(full.log_run - plain.log_run)
    expected = np.full(evidence.runs, np.nan)
    for fold in folds:
        expected[fold.left_out] = expected_log_run(fold.of(evidence), fold.after)[fold.left_out]
    share = share_of_gap(full.log_run - plain.log_run, expected - plain.log_run)
    return FitQuality(
        before=quality(plain),
        after=quality(full),
        log_score_gain=gain.value,
        gain_se=gain.sd,
        floor_onset_deg=_floor_deg(evidence, after),
        gap_closed=share.value,
        gap_closed_se=share.sd,
        ceiling_log_score=_mean(np.where(np.isfinite(plain.log_run), expected, np.nan)).value,
        nested=all(fold.anew for fold in folds),
    )


def share_of_gap(gained: Array, gap: Array) -> Value:
    """Gives the share of the runs' gap (r,), nat, that is gained (r,), with the standard error of a ratio of two means.

    Runs that gain much have a large gap: the error is that of the mean of gained − share · gap, to first order (Cochran
    1977, Sampling Techniques, 6.4). Where the plain model scores within its error of the ceiling there is no gap to
    close, and both are nan.
    """
    whole = _mean(gap)
    if not whole.value > whole.sd:
        return Value(value=math.nan, sd=math.nan, unit="1")
    share = _mean(gained).value / whole.value
    return Value(value=share, sd=_mean(gained - share * gap).sd / whole.value, unit="1")


def _without(evidence: Evidence, folds: Sequence[Fold], alike: Collection[str]) -> HeldOut:
    """Returns the folds' predictions without a class of names."""
    names = [_one_of(fold, alike) for fold in folds]
    rest = [fold.after if name is None else fold.less[name] for fold, name in zip(folds, names, strict=True)]
    return _held(evidence, [(fold.left_out, fit) for fold, fit in zip(folds, rest, strict=True)])


def _adds(full: HeldOut, others: HeldOut, folds: Sequence[Fold], alike: Collection[str]) -> HeldOutGain:
    return HeldOutGain(
        gain=_mean(full.log_run - others.log_run, unit="nat"),
        path=_median(others.path_m - full.path_m, unit="m"),
        folds=sum(_one_of(fold, alike) is not None for fold in folds),
    )


def _one_of(fold: Fold, alike: Collection[str]) -> str | None:
    """Returns the name of a class that was found in a fold; None if none was."""
    return next((name for name in fold.named if called(name) in alike), None)


def quality(held: HeldOut) -> Quality:
    """Returns the summary of predictions, each figure with its standard error."""
    score, within = _mean(held.log_run), _mean(held.within)
    onset, path, turn = np.abs(held.onset_error_deg), held.path_error_mm, held.turn_error_deg
    found = {
        "log_score": score,
        "onset_rmse_deg": _rms(onset),
        "path_rmse_mm": _rms(path),
        "coverage90": within,
        "onset_median_deg": _median(onset),
        "path_median_mm": _median(path),
        "turn_rmse_deg": _rms(turn),
        "turn_median_deg": _median(turn),
    }
    values = {name: figure.value for name, figure in found.items()}
    return Quality(**values, se={name: figure.sd for name, figure in found.items()})


def without_slides(known: Quality) -> Quality:
    """Returns the summary without the errors of slides."""
    unknown = dict.fromkeys(("path_rmse_mm", "path_median_mm", "turn_rmse_deg", "turn_median_deg"), math.nan)
    return replace(known, **unknown, se={**known.se, **unknown})


def _floor_deg(evidence: Evidence, after: Fit) -> float:
    """Returns the root mean square difference of an onset from its expectation, by runs' scatter alone, in degrees."""
    channel = evidence.onsets
    if not isinstance(channel, Onsets):
        return math.nan
    tilt = channel.angle_rad()
    return math.degrees(after.noise.scatter * float(np.sqrt(np.mean((np.sin(tilt) * np.cos(tilt)) ** 2))))


def _mean(values: Array, *, unit: str = "1") -> Value:
    return _valued(figures.mean(values), unit)


def _rms(values: Array) -> Value:
    return _valued(figures.rms(values))


def _median(values: Array, *, unit: str = "1") -> Value:
    return _valued(figures.median(values), unit)


def _valued(figure: figures.Figure, unit: str = "1") -> Value:
    return Value(value=figure.value, sd=figure.sd, unit=unit)
