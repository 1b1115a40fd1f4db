"""Where the mark's edges are: profiles across the predicted edges, a blurred step fitted to each.

Along a profile the light is `dark + contrast × Φ((s − e) / σ)`: Φ is the normal distribution, s the distance outwards,
e the edge's place, σ the blur. Linearised about e = 0 this is one matrix product for all profiles; sampling again
about the corrected edge takes the rest of the non-linearity away.
"""

from math import erf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pi_agent.tracking.lines import Frames
from pi_agent.tracking.pixels import PixelReader

Floats = NDArray[np.float64]

STEPS = np.arange(-3.5, 3.51, 0.5)  # places along a fine profile, in blur deviations
SATURATED = 252.0  # light at which a pixel says no more than "at least this"


class Profiles(NamedTuple):
    """What the profiles (4, n) say: the edge's offset (px), contrast, relative blur error, misfit, and validity."""

    offset: Floats
    contrast: Floats
    blur_error: Floats
    misfit: Floats
    saturated: NDArray[np.bool_]


def _step_model(u: Floats) -> Floats:
    """Derivatives (len(u), 4) of the blurred step by dark level, contrast, place and blur, at contrast 1."""
    density = np.exp(-0.5 * u * u) / np.sqrt(2 * np.pi)
    step = np.array([0.5 * (1.0 + erf(x / np.sqrt(2.0))) for x in u])
    return np.stack([np.ones_like(u), step, -density, -u * density], axis=1)


_MODEL = _step_model(STEPS)
_SOLVE = np.linalg.pinv(_MODEL).T  # samples @ _SOLVE = dark, contrast, contrast × e, contrast × dσ
_MISFIT = np.eye(len(STEPS)) - _SOLVE @ _MODEL.T


def places(frames: Frames, *, count: int, clear_px: float) -> Floats:
    """Distances (4, count) of the profiles from the middles of the edges, clear of both corners."""
    free = np.maximum(frames.length - 2.0 * clear_px, 0.3 * frames.length)
    return free[:, None] * ((np.arange(count) + 0.5) / count - 0.5)


def _points(frames: Frames, along: Floats, across: Floats) -> tuple[Floats, Floats]:
    """Image coordinates (4, n, m) of the samples; `across`: (4 or 1, m) outward distances."""
    base = frames.start[:, None, :] + (0.5 * frames.length[:, None] + along)[:, :, None] * frames.tangent[:, None, :]
    shift = across[:, :, None] * frames.normal[:, None, :]
    return (
        base[:, :, 0][:, :, None] + shift[:, :, 0][:, None, :],
        base[:, :, 1][:, :, None] + shift[:, :, 1][:, None, :],
    )


def measure(reader: PixelReader, frames: Frames, along: Floats, *, blur_px: Floats) -> Profiles:
    """Fits the blurred step to the profile at every place (4, n); `blur_px`: (4,) one for each edge."""
    x, y = _points(frames, along, blur_px[:, None] * STEPS[None, :])
    light = reader.bilinear(x, y)
    answer = light @ _SOLVE
    contrast = answer[:, :, 1]
    safe = np.where(np.abs(contrast) > 1e-3, contrast, 1e-3)
    left_over = light @ _MISFIT
    misfit = np.sqrt(np.einsum("eni,eni->en", left_over, left_over) / (len(STEPS) - 4))
    offset = answer[:, :, 2] / safe * blur_px[:, None]
    return Profiles(offset, contrast, answer[:, :, 3] / safe, misfit, light.max(axis=2) > SATURATED)


def search(reader: PixelReader, frames: Frames, along: Floats, *, reach_px: int) -> tuple[Floats, Floats]:
    """The strongest dark-to-bright step across each place within ± `reach_px`: its offset and strength (4, n)."""
    across = np.arange(-reach_px - 2, reach_px + 3, dtype=np.float64)
    x, y = _points(frames, along, across[None, :])
    light = reader.nearest(x, y)
    rise = light[:, :, 3:-1] + light[:, :, 4:] - light[:, :, :-4] - light[:, :, 1:-3]
    middle = across[2:-2]
    rise = rise * (1.0 - 0.3 * (middle / reach_px) ** 2)
    best = np.argmax(rise, axis=2)
    strength = np.take_along_axis(rise, best[:, :, None], axis=2)[:, :, 0]
    return middle[best], 0.5 * strength
