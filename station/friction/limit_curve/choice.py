"""Chooses the kind of curve that the runs ask for, and its frame."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from scipy import special

from station.friction.anisotropy import CONFOUNDED, LEAST_SAMPLES, ONE_DIRECTION, resultant
from station.friction.limit_curve.curve import Score
from station.friction.limit_curve.maximise import Maximum, first_guess, maximise
from station.friction.limit_curve.observations import Observations
from station.friction.limit_curve.parameters import Layout
from station.friction.limit_curve.shape import Frame, Kind
from station.friction.slides import counted

_SPECIAL = cast(Any, special)
_FRAMES: tuple[Frame, ...] = ("object", "plate")
_FEW_DIRECTIONS = "the plate was tilted along one line relative to the object, so only an isotropic curve can be fitted"
_ONE_FRAME = (
    "the object hardly turned on the plate, so that what is fixed to the object and what to the plate cannot be told "
    "apart; directions are against the object"
)


@dataclass(frozen=True, eq=False)
class Choice:
    """The chosen model, all that were tried with their scores, and what limits them.

    `p_isotropic` is the least p-value of the tests against the isotropic curve, one a frame, times their number (NaN
    if none could be made).
    """

    best: Maximum
    tried: tuple[Maximum, ...]
    scores: tuple[Score, ...]
    p_isotropic: float
    remarks: tuple[str, ...]


def choose(observations: Observations, *, uncounted: Mapping[str, int] | None = None) -> Choice:
    """Fits every kind of curve that the runs can tell apart, and takes the one of the least BIC.

    The frame is found with one-way curves, which have whatever is common; ellipse and general curve are then fitted in
    the best frame. `uncounted` has the number of samples that tell nothing of a curve by the reason.

    Raises:
        ValueError: saying in a sentence why no curve can be fitted.
    """
    resolved = int(observations.resolved.sum())
    if resolved < LEAST_SAMPLES:
        others = ", ".join(f"{count} {why}" for why, count in (uncounted or {}).items())
        raise ValueError(
            f"No limit curve can be fitted to {counted(resolved)} with a known direction; {LEAST_SAMPLES} are needed."
            + (f" Left out: {others}." if others else "")
        )
    plain = Layout("isotropic", "object")
    isotropic = maximise(plain, observations, start=first_guess(observations), start_layout=plain)
    tried, remarks = [isotropic], list[str]()
    frames: list[Frame] = [frame for frame in _FRAMES if resultant(_towards(observations, frame)) < ONE_DIRECTION]
    if not frames:
        remarks.append(_FEW_DIRECTIONS)
    elif resultant(observations.orientation_rad) > CONFOUNDED:
        frames = frames[:1]
        remarks.append(_ONE_FRAME)
    for frame in frames:
        tried.append(_from(isotropic, observations, kind="one_way", frame=frame))
    if len(frames) == 2:
        better = min(tried[1:], key=lambda one: one.bic)
        tried.append(_from(better, observations, kind="one_way", frame="both"))
    if frames:
        frame = min(tried[1:], key=lambda one: one.bic).layout.frame
        one_way = next(one for one in tried[1:] if one.layout.frame == frame)
        tried += [_from(one_way, observations, kind=kind, frame=frame) for kind in ("ellipse", "general")]
    scores = tuple(_score(one, tried) for one in tried)
    tests = [_p_value(one, isotropic) for one in tried if one.layout.kind == "one_way" and one.layout.frame != "both"]
    return Choice(
        best=min(tried, key=lambda one: one.bic),
        tried=tuple(tried),
        scores=scores,
        p_isotropic=min(1.0, len(tests) * min(tests)) if tests else math.nan,
        remarks=tuple(remarks),
    )


def _from(start: Maximum, observations: Observations, *, kind: Kind, frame: Frame) -> Maximum:
    return maximise(Layout(kind, frame), observations, start=start.values, start_layout=start.layout)


def _towards(observations: Observations, frame: Frame) -> np.ndarray[Any, np.dtype[np.float64]]:
    return observations.towards_object_rad if frame == "object" else observations.towards_plate_rad


def _score(one: Maximum, tried: list[Maximum]) -> Score:
    simpler = _simpler(one, tried)
    return Score(
        kind=one.layout.kind,
        frame=one.layout.frame,
        shape_parameters=len(one.layout.shape_names),
        log_likelihood=one.log_likelihood,
        bic=one.bic,
        against="" if simpler is None else _name(simpler.layout),
        p_value=math.nan if simpler is None else _p_value(one, simpler),
    )


def _name(layout: Layout) -> str:
    return layout.kind if layout.kind == "isotropic" else f"{layout.kind} ({layout.frame})"


def _simpler(one: Maximum, tried: list[Maximum]) -> Maximum | None:
    """Returns the model to test against: the largest that this one contains."""
    inside = [
        other
        for other in tried
        if len(other.values) < len(one.values) and set(other.layout.names) <= set(one.layout.names)
    ]
    return max(inside, key=lambda other: (len(other.values), other.log_likelihood), default=None)


def _p_value(one: Maximum, simpler: Maximum) -> float:
    """Returns the p-value of the likelihood-ratio test (Wilks).

    The ease counts as a parameter although it has no effect without a shape: the test is then on the safe side.
    """
    gain = max(2 * (one.log_likelihood - simpler.log_likelihood), 0.0)
    return float(_SPECIAL.chdtrc(len(one.values) - len(simpler.values), gain))
