"""Where the mark's edges are: profiles across the expected edges, a blurred step fitted to each.

Along a profile the light is `dark + contrast × Φ((s − e) / σ)`: Φ is the normal distribution, s the distance outwards,
e the edge's place, σ the blur. Linearised about e = 0 this is one matrix product for all profiles; what the estimator
answers to a step that lies elsewhere is known, and turned back by a table.

The fit is by generalised least squares: the pixels' noise, and for a bare tape the texture of the plate beside it,
seen through the blur. Texture disturbs the bright side only, so the dark foot of the edge counts more; how far the foot
reaches depends on the blur, so beside texture the blur must be known, from all four edges and from earlier frames.
"""

from functools import lru_cache
from math import erf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pi_agent.tracking.lines import Edges, places
from pi_agent.tracking.pixels import Light, PixelReader

Floats = NDArray[np.float64]
Matrix = NDArray[np.float32]

STEPS = np.arange(-3.0, 3.01, 0.5)  # places along a fine profile, in blur deviations
SATURATED = 252.0  # light at which a pixel says no more than "at least this"
NOISE = 0.009  # of the pixels, in contrasts, as far as it is left in the mean of neighbouring profiles
DIM_NOISE = 0.02  # the same in dim light
OTHER_NOISE = 0.06, 0.1  # noise and relative error of the blur for an estimator beside a margin that minds shadows less
KNOWN_BLUR = 0.02  # relative error of a blur that is taken as known
REACH = np.linspace(-1.6, 1.6, 65)  # places of an edge for which the estimator's answer is known, in blur deviations
TEXTURE = 0.15  # relative deviation of a plate's reflectance
TEXTURE_LENGTH = 3.0  # its correlation length, in blur deviations

LEAST_GAIN = 0.4  # change of the estimator's answer per change of the place, below which it tells too little


class StepModel(NamedTuple):
    """Matrices for `light @ matrix`: `solve` (m, 5) and `misfit` (m, m).

    `solve`: contrast, contrast × e, contrast × dσ; contrast and contrast × e once more, by an estimator that leans on
    neither side of the edge and is pulled further by the texture. `table` and `other_table`: see `Table`.
    """

    solve: Matrix
    misfit: Matrix
    table: "Table"
    other_table: "Table"


class Table(NamedTuple):
    """e as an estimator gives it for a step at each of `reach`, in blur deviations, both increasing."""

    answers: Floats
    reach: Floats

    def place(self, answer: Floats) -> Floats:
        """Where the steps lie, in blur deviations."""
        return np.interp(answer, self.answers, self.reach)


class Profiles(NamedTuple):
    """What the profiles (4, n) say.

    Their place on the expected edge, the edge's offset (px), how much further out it seems to an estimator that leans
    on neither side (px), the light in the dark, contrast, contrast × relative blur error, misfit (RMS), and whether a
    pixel was saturated (None: none was).
    """

    base: NDArray[np.complex128]
    offset: Floats
    pull: Floats
    dark: Matrix
    contrast: Matrix
    blur_change: Matrix
    misfit: Matrix
    saturated: NDArray[np.bool_] | None


@lru_cache(maxsize=8)
def step_model(*, textured: bool, known_blur: bool = False, noise: float = NOISE) -> StepModel:
    """The estimator for a mark beside a textured plate, or beside its own white margin.

    `known_blur`: e is estimated with the blur as given; its error is estimated all the same, as if it were not.
    `noise`: of the pixels, in contrasts.
    """
    model = _derivatives(STEPS)
    covariance = _covariance(STEPS, noise=noise, texture=TEXTURE if textured else 0.0)
    free = _solution(model, covariance, blur_error=np.inf)
    solve = _solution(model, covariance, blur_error=KNOWN_BLUR) if known_blur else free
    plain = np.linalg.pinv(model).T
    misfit = (np.eye(len(STEPS)) - plain @ model.T) / np.sqrt(len(STEPS) - 4)
    other = _other(textured=textured, noise=noise)
    wanted = np.stack([solve[:, 1], solve[:, 2], free[:, 3], other[:, 1], other[:, 2]], axis=1)
    return StepModel(wanted.astype(np.float32), misfit.astype(np.float32), _table(solve), _table(other))


def _other(*, textured: bool, noise: float) -> Floats:
    """An estimator that minds uneven light beside the edge less than the one in use, or more where that minds none."""
    model = _derivatives(STEPS)
    if textured:
        return _solution(model, _covariance(STEPS, noise=noise, texture=0.0), blur_error=KNOWN_BLUR)
    noise, blur_error = OTHER_NOISE
    return _solution(model, _covariance(STEPS, noise=noise, texture=TEXTURE), blur_error=blur_error)


def _table(solve: Floats) -> Table:
    """What the estimator answers to steps away from where it expects them, as far as that tells them apart."""
    steps = np.stack([_derivatives(STEPS - place)[:, 1] for place in REACH])
    answers = (steps @ solve[:, 2]) / (steps @ solve[:, 1])
    flat = np.gradient(answers, REACH) < LEAST_GAIN
    left = REACH[flat & (REACH < 0)].max(initial=REACH[0])
    right = REACH[flat & (REACH > 0)].min(initial=REACH[-1])
    told = (left <= REACH) & (right >= REACH)
    return Table(answers[told], REACH[told])


def _derivatives(u: Floats) -> Floats:
    """Derivatives (len(u), 4) of the blurred step by dark level, contrast, place and blur, at contrast 1."""
    density = np.exp(-0.5 * u * u) / np.sqrt(2 * np.pi)
    step = np.array([0.5 * (1.0 + erf(x / np.sqrt(2.0))) for x in u])
    return np.stack([np.ones_like(u), step, -density, -u * density], axis=1)


def _solution(model: Floats, covariance: Floats, *, blur_error: float) -> Floats:
    """Generalised least squares (m, 4); the relative error of the blur is expected to be about `blur_error`."""
    weight = np.linalg.inv(covariance)
    information = model.T @ weight @ model + np.diag([0.0, 0.0, 0.0, blur_error**-2])
    return np.asarray(np.linalg.solve(information, model.T @ weight).T, dtype=np.float64)


def _covariance(u: Floats, *, noise: float, texture: float) -> Floats:
    """Covariance (m, m) of a profile's samples: pixel noise shared by interpolation, and texture beyond the edge."""
    shared = noise**2 * np.exp(-np.abs(u[:, None] - u) / 0.5)
    outside = np.arange(0.05, 8.0, 0.1)
    spread = 0.1 * np.exp(-0.5 * (u[:, None] - outside) ** 2) / np.sqrt(2 * np.pi)
    correlation = np.exp(-np.abs(outside[:, None] - outside) / TEXTURE_LENGTH)
    return shared + texture**2 * (spread @ correlation @ spread.T)


def measure(reader: PixelReader, edges: Edges, *, blur_px: Floats, count: int, model: StepModel) -> Profiles:
    """Fits the blurred step to `count` profiles on every edge; `blur_px`: (4,) one for each edge."""
    base = edges.middle[:, None] + np.multiply.outer(edges.tangent * edges.free, places(count))
    across = np.multiply.outer((-1j * edges.tangent) * blur_px, STEPS)
    points = base.astype(np.complex64)[:, :, None] + across.astype(np.complex64)[:, None, :]
    light = reader.bilinear(points)
    flat = light.reshape(-1, len(STEPS))
    answer = (flat @ model.solve).reshape(4, count, 5)
    contrast = np.maximum(answer[:, :, 0], 0.5)
    left_over = flat @ model.misfit
    misfit = np.sqrt(np.einsum("ij,ij->i", left_over, left_over)).reshape(4, count)
    offset = model.table.place(answer[:, :, 1] / contrast) * blur_px[:, None]
    other = model.other_table.place(answer[:, :, 4] / np.maximum(answer[:, :, 3], 0.5)) * blur_px[:, None]
    dark = light[:, :, 0] + light[:, :, 1]
    return Profiles(base, offset, other - offset, 0.5 * dark, contrast, answer[:, :, 2], misfit, _saturated(light))


def _saturated(light: Light) -> NDArray[np.bool_] | None:
    return light.max(axis=2) > SATURATED if light.max() > SATURATED else None


def search(reader: PixelReader, edges: Edges, *, count: int, reach_px: int) -> tuple[Floats, Floats]:
    """The strongest dark-to-bright step across each place within ± `reach_px`: its offset and strength (4, count)."""
    steps = np.arange(-reach_px - 2, reach_px + 3, dtype=np.float64)
    base = edges.middle[:, None] + np.multiply.outer(edges.tangent * edges.free, places(count))
    across = np.multiply.outer(-1j * edges.tangent, steps)
    light = reader.nearest((base[:, :, None] + across[:, None, :]).astype(np.complex64))
    rise = light[:, :, 3:-1] + light[:, :, 4:] - light[:, :, :-4] - light[:, :, 1:-3]
    middle = steps[2:-2]
    rise = rise * (1.0 - 0.3 * (middle / reach_px) ** 2)
    best = np.argmax(rise, axis=2)
    strength = np.take_along_axis(rise, best[:, :, None], axis=2)[:, :, 0]
    return middle[best], 0.5 * strength.astype(np.float64)
