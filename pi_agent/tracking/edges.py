"""Finds the mark's edges: profiles across the expected edges, a blurred step fitted to each (see `steps`)."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pi_agent.tracking.lines import Edges, places
from pi_agent.tracking.pixels import Light, PixelReader
from pi_agent.tracking.steps import SOLVED, StepModel

Floats = NDArray[np.float64]
Points = NDArray[np.complex128]
Matrix = NDArray[np.float32]

MEAN_BOW = np.float32(1.0 / 6.0)  # the mean of f (1 − f), f even between 0 and 1
SATURATED = 252.0  # light at which a pixel says no more than "at least this"


class Profiles(NamedTuple):
    """The readings of the profiles, (4, n) unless said otherwise.

    Attributes:
        offset: place of the edge, outwards from where it was expected, px.
        pull: how much further out it seems to an estimator that leans on neither side, px.
        sloped: (4, n, 2) contrast and contrast × e by an estimator that allows for a slope in the light.
        dark: light on the dark side, of 255.
        contrast: step of the light, of 255.
        blur_change: relative error of the blur.
        misfit: RMS departure of the light from the step, of 255.
        saturated: True where a pixel was saturated; None: nowhere.
        light: (4, n, m) the light itself, of 255.
        glowing: True where a highlight lies, so that the profile does not show the blur; None: nowhere.
    """

    offset: Floats
    pull: Floats
    sloped: Matrix
    dark: Matrix
    contrast: Matrix
    blur_change: Floats
    misfit: Matrix
    saturated: NDArray[np.bool_] | None
    light: Light
    glowing: NDArray[np.bool_] | None = None


def measure(reader: PixelReader, edges: Edges, *, blur_px: Floats, count: int, model: StepModel) -> Profiles:
    """Fits the blurred step to `count` profiles on every edge; `blur_px`: (4,) the lens's blur for each edge."""
    outward = edges.tangent * (-1j * blur_px)
    inner, outer = model.steps[..., 0], model.steps[..., -1]
    size = model.steps.shape[-1]
    light, read_at = reader.profiles(
        edges.middle + outward * inner, edges.tangent * edges.free, outward * (outer - inner), count=count, size=size
    )
    answer = _times(light, model.solve_and_misfit)
    if model.uneven is not None:
        blurred = _blur_between_pixels(read_at, edges.tangent, blur_px)
        excess = _times(blurred.reshape(light.shape), model.uneven)
        excess *= answer[:, :, :1]
        answer[:, :, :SOLVED] -= excess
    contrast = np.maximum(answer[:, :, 0], 0.5)
    place = model.table.place(answer[:, :, 1] / contrast)
    other = model.other_table.place(answer[:, :, 4] / np.maximum(answer[:, :, 3], 0.5))
    # A step away from where it was expected is read as wider than it is.
    wider = answer[:, :, 2] / contrast - (place * place) * model.widening.reshape(-1, 1)
    scale = blur_px[:, None]
    offset = place * scale
    further = other * scale - offset
    dark = 0.5 * (light[:, :, 0] + light[:, :, 1])
    misfit = _root_of_squares(answer[:, :, SOLVED:])
    return Profiles(offset, further, answer[:, :, 5:SOLVED], dark, contrast, wider, misfit, _saturated(light), light)


def _blur_between_pixels(read_at: Light, tangent: Points, blur_px: Floats) -> Light:
    """Returns the share of its blur by which a step seems wider at each place (4, n) than where it is read on average.

    Light between two pixels is that of a line between them, which cuts off a curve's bow: by half its second derivative
    times f (1 − f), where f is the share of the way. Along an edge at 0° or 45° all profiles have the same f.
    """
    # Across an edge x counts by the normal's part along x, which is the tangent's along y.
    weight = [
        [(t.imag**2 / (2.0 * b * b), t.real**2 / (2.0 * b * b))]
        for t, b in zip(tangent.tolist(), blur_px.tolist(), strict=True)
    ]
    share = np.floor(read_at)
    np.subtract(read_at, share, out=share)
    bow = share * share
    np.subtract(share, bow, out=bow)
    bow -= MEAN_BOW
    return np.matmul(np.array(weight, dtype=np.float32), bow.reshape(4, 2, -1))[:, 0]


def misfits(light: Light, matrix: Matrix) -> Matrix:
    """Returns the departure (4, n), RMS, of 255, of profiles from what `matrix` removes.

    Args:
        light: (4, n, m) the profiles, of 255.
        matrix: (m, m) for all edges, or (4, m, m), one for each; it has no unit.
    """
    return _root_of_squares(_times(light, matrix))


def _root_of_squares(values: Matrix) -> Matrix:
    return np.sqrt(np.einsum("eij,eij->ei", values, values))


def _times(light: Light, matrix: Matrix) -> Matrix:
    """Returns `light` (4, n, m) @ `matrix`, (m, k) or one for each edge (4, m, k)."""
    if matrix.ndim == 3:
        return np.matmul(light, matrix)
    flat = light.reshape(-1, light.shape[2]) @ matrix
    return flat.reshape(light.shape[0], light.shape[1], -1)


def _saturated(light: Light) -> NDArray[np.bool_] | None:
    return light.max(axis=2) > SATURATED if light.max() > SATURATED else None


def search(reader: PixelReader, edges: Edges, *, count: int, reach_px: int) -> tuple[Floats, Floats]:
    """Returns the strongest dark-to-bright step across each place within ± `reach_px`.

    It returns the step's offset and strength (4, count).
    """
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
