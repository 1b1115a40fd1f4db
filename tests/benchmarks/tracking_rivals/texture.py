"""An unknown plate adds to the pixels beside a bare tape: the covariance of its texture, seen past the mark."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.special import erf

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

REACH_PX = 4  # reach of the lens's spread and the pixel together: beyond it less than a thousandth of the light
NEGLIGIBLE = 1e-4  # share of the plate that is uncovered, below which none of it is seen


def autocovariance(plate: NDArray[np.float32], *, reach: int) -> Floats:
    """Covariance (2 reach + 1, same) of a plate's reflectance with that so many rows and columns away."""
    field = np.asarray(plate, dtype=np.float64) - float(plate.mean())
    spectrum = np.abs(np.fft.rfft2(field, s=[2 * n for n in field.shape])) ** 2
    lags = np.fft.irfft2(spectrum, s=[2 * n for n in field.shape]) / field.size
    wanted = np.arange(-reach, reach + 1)
    return lags[np.ix_(wanted, wanted)]


def texture_covariance(lags: Floats, *, seen: Bools, open_share: Floats, blur_px: float) -> Floats:
    """Covariance (n, n) of the plate's light in the `seen` pixels (h, w), n of them.

    `open_share` (h, w): the share of each place of the plate that the mark leaves uncovered.
    """
    places = np.argwhere(_grown(seen) & (open_share > NEGLIGIBLE))
    pixels = np.argwhere(seen)
    through = _spread(pixels, places, blur_px) * open_share[places[:, 0], places[:, 1]]
    sparse = csr_matrix(through)
    middle = lags.shape[0] // 2
    apart = places[:, None] - places[None] + middle
    covariance = lags[apart[..., 0], apart[..., 1]]
    return np.asarray(sparse @ (sparse @ covariance).T)


def _grown(seen: Bools) -> Bools:
    """The pixels within the lens's reach of those given."""
    padded = np.pad(seen, REACH_PX)
    shifts = range(2 * REACH_PX + 1)
    rows = np.any([padded[shift : shift + seen.shape[0]] for shift in shifts], axis=0)
    return np.any([rows[:, shift : shift + seen.shape[1]] for shift in shifts], axis=0)


def _spread(pixels: NDArray[np.intp], places: NDArray[np.intp], blur_px: float) -> Floats:
    """The share (n, m) of a place's light that falls on a pixel."""
    lags = np.arange(-REACH_PX - 1, REACH_PX + 2)
    kernel = np.array([_pixel_to_pixel(float(lag), blur_px) for lag in lags])
    share = 1.0
    for axis in (0, 1):
        apart = np.clip(pixels[:, None, axis] - places[None, :, axis], -REACH_PX - 1, REACH_PX + 1)
        share = share * kernel[apart + REACH_PX + 1]
    return np.where(share > NEGLIGIBLE / 10, share, 0.0)


def _pixel_to_pixel(lag: float, blur_px: float) -> float:
    """The share of a square pixel's light that a Gaussian spread puts on the pixel `lag` further on."""
    if abs(lag) > REACH_PX:
        return 0.0
    return float(_twice(lag + 1.0, blur_px) - 2.0 * _twice(lag, blur_px) + _twice(lag - 1.0, blur_px))


def _twice(x: float, blur_px: float) -> float:
    """The normal distribution of this deviation, integrated up to x."""
    u = x / blur_px
    return x * 0.5 * (1.0 + erf(u / np.sqrt(2.0))) + blur_px * float(np.exp(-0.5 * u * u)) / np.sqrt(2.0 * np.pi)
