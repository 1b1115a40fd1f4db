"""Plate surfaces: fields of reflectance without marks, in linear light."""

from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

Plate = NDArray[np.float32]
Surface = Literal["wood", "steel", "plain"]

PAD_PX = 64
"""Surface beyond the frame on every side, so that a sagging camera still sees it."""

SCRATCHES = 12 / 728**2
"""Scratches on brushed steel, for each square pixel."""


def surface(kind: Surface, *, rng: np.random.Generator, size: int = 600) -> Plate:
    """Returns a (size + 2 PAD_PX, same) field of reflectance 0…1 of the kind given."""
    shape = (size + 2 * PAD_PX, size + 2 * PAD_PX)
    if kind == "wood":
        return _wood(shape, rng)
    return _steel(shape, rng) if kind == "steel" else np.full(shape, 0.5, dtype=np.float32)


def _smooth_noise(shape: tuple[int, int], rng: np.random.Generator, *, sigma: tuple[float, float]) -> Plate:
    """Returns Gaussian noise of unit deviation, smoothed by (sigma_x, sigma_y) pixels."""
    noise = rng.standard_normal(shape, dtype=np.float32)
    field = cv2.GaussianBlur(noise, (0, 0), sigmaX=sigma[0], sigmaY=sigma[1])
    return np.asarray(field / field.std(), dtype=np.float32)


def _wood(shape: tuple[int, int], rng: np.random.Generator) -> Plate:
    """Draws year rings that wander, fibres along the grain, pores; mean 0.45, deviation about a fifth of it."""
    rows = np.arange(shape[0], dtype=np.float32)[:, None]
    wander = 14.0 * _smooth_noise(shape, rng, sigma=(90.0, 25.0))
    rings = np.sin((rows + wander) * np.float32(2 * np.pi / 31.0))
    fibres = _smooth_noise(shape, rng, sigma=(12.0, 0.7))
    pores = np.clip(_smooth_noise(shape, rng, sigma=(5.0, 0.6)) - 2.0, 0.0, 2.0)
    return np.clip(0.45 + 0.045 * rings + 0.035 * fibres - 0.12 * pores, 0.05, 0.95).astype(np.float32)


def _steel(shape: tuple[int, int], rng: np.random.Generator) -> Plate:
    """Draws brushed steel: fine streaks, a broad sheen, a few scratches; mean 0.5."""
    streaks = _smooth_noise(shape, rng, sigma=(25.0, 0.5))
    grain = _smooth_noise(shape, rng, sigma=(2.0, 0.5))
    columns = np.linspace(-1.0, 1.0, shape[1], dtype=np.float32)[None, :]
    sheen = 0.10 * np.exp(-((columns - rng.uniform(-0.5, 0.5)) ** 2) / 0.3)
    field = (0.46 + sheen + 0.035 * streaks + 0.02 * grain).astype(np.float32)
    _scratch(field, rng, count=round(field.size * SCRATCHES))
    return np.clip(field, 0.05, 0.95)


def _scratch(field: Plate, rng: np.random.Generator, *, count: int) -> None:
    for start, angle, length in zip(
        rng.uniform(0, field.shape[0], (count, 2)),
        rng.normal(0.0, 0.3, count),
        rng.uniform(40, 200, count),
        strict=True,
    ):
        end = start + length * np.array([np.cos(angle), np.sin(angle)])
        tone = float(rng.choice([0.3, 0.75]))
        cv2.line(field, tuple(start.astype(int).tolist()), tuple(end.astype(int).tolist()), tone, 1, cv2.LINE_AA)
