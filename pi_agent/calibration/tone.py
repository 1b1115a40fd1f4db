"""The tone curve and the noise, from pictures of a resting scene at several exposures.

A pixel that gathers light at the rate E shows the value v with g(v) = E t after the exposure t; g is the inverse of the
tone curve and the same for all pixels (Debevec & Malik 1997, equation 2, without their logarithm). g is piecewise
linear between `KNOTS` values, g(0) = 0, and all g and E come from one linear least-squares problem.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pi_agent.cameras import Image
from pi_agent.tracking.tone import ToneCurve
from shared.errors import UserError

Floats = NDArray[np.float64]

KNOTS = 17
PLACES = 300
SATURATED = 248
DARK = 2.0
SMOOTH = 0.02
LEAST_SPAN = 100.0
"""Values must have been seen over so much of 0…255 for the curve to be told."""
WORST_RESIDUAL = 0.02
LINEAR_WITHIN = 0.015


@dataclass(frozen=True)
class Exposed:
    """Frames (n, height, width) uint8 of one exposure."""

    exposure_ms: float
    frames: Image


@dataclass(frozen=True)
class ToneFit:
    """The curve, the RMS of what it leaves (share of full scale), its greatest distance from a straight line."""

    curve: ToneCurve
    residual: float
    bend: float
    highest_value: float

    @property
    def is_linear(self) -> bool:
        """True if nothing needs to be undone."""
        return self.bend < LINEAR_WITHIN


@dataclass(frozen=True)
class Noise:
    """Shot and read noise: electrons at full scale, and read noise in electrons."""

    full_scale_e: float
    read_noise_e: float


def fit_tone(series: Sequence[Exposed], *, rng: np.random.Generator) -> ToneFit:
    """Returns the tone curve from two and more exposures of a scene at rest.

    Raises:
        UserError: when the pictures do not tell it.
    """
    times = np.array([exposed.exposure_ms for exposed in series])
    values = _pixels([exposed.frames.mean(axis=0) for exposed in series], rng)
    usable = (values < SATURATED) & (values > DARK)
    usable &= usable.sum(axis=1, keepdims=True) >= 2
    if len(set(times.tolist())) < 2 or not usable.any() or np.ptp(values[usable]) < LEAST_SPAN:
        raise UserError(
            "Expected pictures from dark to bright over at least two exposures, got values that hardly differ: let "
            "the brightest part of the picture be just below white at exposure_ms"
        )
    highest = float(values[usable].max())
    inverse, residual = _solve(values, times, usable)
    inverse, bend = _straightened(inverse, seen=max(int(highest / 255.0 * (KNOTS - 1)), 2))
    if np.any(np.diff(inverse) <= 0) or residual > WORST_RESIDUAL:
        raise UserError(
            f"Expected values that grow with the exposure, got something else (residual {100 * residual:.1f} % of full "
            "scale): does the light flicker, does the scene move, is the automatic exposure off?"
        )
    knots = np.linspace(0.0, 1.0, KNOTS)
    curve = ToneCurve("measured", tuple(inverse.tolist()), tuple(knots.tolist()))
    return ToneFit(curve, residual, bend, highest)


def _straightened(inverse: Floats, *, seen: int) -> tuple[Floats, float]:
    """Returns g carried on straight above knot `seen`, the last one reached, and its bend below.

    The bend is a share of full scale.
    """
    knots = np.arange(KNOTS)
    back = min(3, seen)
    slope = (inverse[seen] - inverse[seen - back]) / back
    whole = np.where(knots <= seen, inverse, inverse[seen] + slope * (knots - seen))
    below = knots[: seen + 1]
    line = float(whole[: seen + 1] @ below / (below @ below))
    bend = float(np.abs(whole[: seen + 1] - line * below).max() / (line * (KNOTS - 1)))
    return whole / whole[-1], bend


def _pixels(means: list[Floats], rng: np.random.Generator) -> Floats:
    """Returns mean values (pixels, exposures) of pixels spread over the values of the brightest picture."""
    brightest = means[int(np.argmax([float(mean.mean()) for mean in means]))].ravel()
    order = np.argsort(brightest + rng.uniform(0.0, 1e-3, brightest.size))
    # Even steps in value, not in rank: a plate is mostly of one grey.
    targets = np.linspace(brightest.min(), min(brightest.max(), SATURATED - 1.0), PLACES)
    chosen = order[np.clip(np.searchsorted(brightest[order], targets), 0, brightest.size - 1)]
    return np.stack([mean.ravel()[chosen] for mean in means], axis=1)


def _solve(values: Floats, times: Floats, usable: NDArray[np.bool_]) -> tuple[Floats, float]:
    """Returns g at the knots, scaled to g(255) = 1, and the RMS residual.

    The scale of light is free. It is fixed by the mean of g over all samples, because fixing it at one knot would let
    the others shrink to nothing.
    """
    has_usable = usable.any(axis=1)
    values, usable = values[has_usable], usable[has_usable]
    pixel, shot = np.nonzero(usable)
    position = values[pixel, shot] / 255.0 * (KNOTS - 1)
    below = np.minimum(position.astype(int), KNOTS - 2)
    share = position - below
    count, line = len(pixel), np.arange(len(pixel))
    rows = np.zeros((count + KNOTS - 1, KNOTS + len(values)))
    rows[line, below] += 1.0 - share
    rows[line, below + 1] += share
    mean = rows[:count].mean(axis=0)
    rows[line, KNOTS + pixel] = -times[shot] / times.max()
    for knot in range(1, KNOTS - 1):
        rows[count + knot - 1, knot - 1 : knot + 2] = SMOOTH * np.array([1.0, -2.0, 1.0])
    rows[-1] = count * mean
    target = np.zeros(len(rows))
    target[-1] = count * float(position.mean()) / (KNOTS - 1)
    wanted = rows[:, 1:]  # g(0) is 0 and no unknown
    solution = np.linalg.solve(wanted.T @ wanted, wanted.T @ target)
    full = float(solution[KNOTS - 2])
    residual = float(np.sqrt(np.mean((wanted[:count] @ solution) ** 2))) / full
    return np.concatenate([[0.0], solution[: KNOTS - 1] / full]), residual


def fit_noise(exposed: Exposed, curve: ToneCurve) -> Noise | None:
    """Returns shot and read noise in linear light.

    The variance is signal / full scale + read noise² (the photon transfer curve).

    Rounding to whole values is taken out. None when the picture has too little range to tell the two apart.
    """
    table = curve.to_light_table().astype(np.float64) / 255.0
    light = table[exposed.frames]
    mean, variance = light.mean(axis=0), light.var(axis=0, ddof=1)
    value = exposed.frames.mean(axis=0)
    step = np.gradient(table)[np.clip(np.round(value), 0, 255).astype(int)]
    variance = variance - step**2 / 12.0
    clear = (value > 4) & (value < SATURATED)
    edges = np.quantile(mean[clear], np.linspace(0, 1, 25)) if clear.any() else np.zeros(2)
    if float(np.ptp(edges)) < 0.1:
        return None
    bins = np.clip(np.digitize(mean[clear], edges) - 1, 0, 23)
    filled = [number for number in range(24) if np.count_nonzero(bins == number) > 50]
    x = np.array([mean[clear][bins == number].mean() for number in filled])
    y = np.array([variance[clear][bins == number].mean() for number in filled])
    # Relative weights: the scatter of a variance grows with it.
    slope, floor = np.linalg.lstsq(np.column_stack([x, np.ones_like(x)]) / y[:, None], np.ones_like(y), rcond=None)[0]
    if slope <= 0:
        return None
    return Noise(float(1.0 / slope), float(np.sqrt(max(floor, 0.0)) / slope))
