"""Stretches of frames: the means of a block's pose and of its mark's corners while hardly anything changes."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from station.diagnosis.observations.tracks import RunTrack
from station.diagnosis.observations.views import block_view
from station.physics.contact import Array, View

if TYPE_CHECKING:
    from station.diagnosis.observations.build import Recorded

STRETCHES = 4
"""The stretches of a tilt."""

BEFORE_SLIP_NS = 30_000_000
"""A block is seen at rest until so long before a slip as read, which is off by about as much, ns."""

LEAST_FRAMES = 3
DEGREE = 3
"""The degree of a path in one stretch: its pull changes with the tilt, about evenly (see `mean_slopes`)."""
MEAN_POINTS = 24

STRETCH = np.dtype(
    [
        ("run", np.int64), ("from_ns", np.int64), ("to_ns", np.int64), ("tilt_ns", np.int64), ("slip_ns", np.int64),
        ("frames", np.int64), ("spread_s", np.float64),
        ("pose", np.float64, 3), ("corner_m", np.float64, (4, 2)), ("velocity", np.float64, 2),
        ("acceleration", np.float64, 2), ("yaw_rate", np.float64),
        ("sigma_m", np.float64), ("corner_sigma_m", np.float64),
    ]
)  # fmt: skip
"""A stretch: the run's index in the evidence, its times, those of the tilt's begin and of the slip (or the run's end),
the number of frames, the standard deviation of their times, and the means.

The mean corners are nan for a block that another tracker follows; the last two are the noise of a single frame."""

Stretches = NDArray[Any]
"""Stretches (n,) with the fields of STRETCH."""


def spans(from_ns: int, to_ns: int) -> Iterator[tuple[int, int]]:
    """Divides a time into STRETCHES equal parts; gives begin and end of each in ns."""
    return itertools.pairwise(np.linspace(from_ns, to_ns, STRETCHES + 1).astype(np.int64).tolist())


def stretch(run: int, track: RunTrack, from_ns: int, to_ns: int, *, moving: bool = False) -> tuple[Any, ...] | None:
    """Returns one row of `Stretches`; None with too few frames.

    Only of a `moving` block are velocity and acceleration not taken for 0.
    """
    part = track.frames(from_ns, to_ns)
    count = part.stop - part.start
    if count < LEAST_FRAMES:
        return None
    times, pose = track.time_ns[part], track.pose[part]
    mean, seconds = pose.mean(axis=0), (times - times[0]) * 1e-9
    slopes, bends = mean_slopes(seconds, pose) if moving else np.zeros((2, 3))
    corners = np.full((4, 2), np.nan)
    if track.corner_m is not None:
        corners = mean[:2] + mean_shape(track.corner_m[part], pose[:, 2] - mean[2])
    noise = (track.sigma_m, track.corner_sigma_m)
    times_ns = times[0], times[-1], track.tilt_ns, track.slip_ns or track.end_ns
    return run, *times_ns, count, seconds.std(), mean, corners, slopes[:2], bends[:2], slopes[2], *noise


def mean_slopes(seconds: Array, values: Array) -> tuple[Array, Array]:
    """Gives means (k,) over the frames of the slopes, 1/s, and second derivatives, 1/s², by a cubic.

    It goes through `values` (n, k) at `seconds` (n,). In a slide the plate turns back, and its pull falls by some 7
    m/s³. A straight line's slope, which the middle of a stretch decides, is .6 % above the mean, which shears the mean
    picture (tests/unit/diagnosis/test_image_rows.py).
    """
    centred = seconds - seconds.mean()
    powers = np.arange(min(DEGREE, len(seconds) - 1), 0, -1)
    terms = np.polyfit(centred, values, int(powers[0]))[:-1]
    slopes = powers * (centred[:, None] ** (powers - 1)).mean(axis=0)
    bends = powers * (powers - 1) * (centred[:, None] ** np.maximum(powers - 2, 0)).mean(axis=0)
    return slopes @ terms, bends @ terms


def mean_shape(seen: Array, turned_rad: Array) -> Array:
    """Returns the mean corners (4, 2), m, around their centre, of `seen` (n, 4, 2), m, turned by `turned_rad` (n,).

    Each frame's corners are turned back by what that frame shows: the mean of a square in many headings is a smaller
    square. A steady turn will not do: an uneven sole turns a block by 50 rad/s², which shrinks the mean by .01 %.
    """
    offset = seen - seen.mean(axis=1, keepdims=True)
    cosine, sine = np.cos(turned_rad), np.sin(turned_rad)
    back = np.stack([np.stack([cosine, -sine], axis=-1), np.stack([sine, cosine], axis=-1)], axis=-2)
    return (offset @ back).mean(axis=0)


def view_of(stretches: Stretches, recorded: Recorded) -> View:
    """Returns the camera's view of the block's mark in each of `stretches` (n,), with fields in STRETCH's units."""
    middle = (stretches["from_ns"] + stretches["to_ns"]) // 2
    tilt_rad, down_rad = mean_attitude(recorded, stretches["from_ns"], stretches["to_ns"])
    return block_view(
        recorded,
        stretches["pose"],
        velocity_m_s=stretches["velocity"],
        acceleration_m_s2=stretches["acceleration"],
        yaw_rate_rad_s=stretches["yaw_rate"],
        tilt_rad=tilt_rad,
        down_rad=down_rad,
        rest_s=np.maximum((middle - stretches["tilt_ns"]) * 1e-9, 0.0),
        limit_rad=recorded.plate.at(stretches["slip_ns"]).tilt_rad,
    )


def mean_attitude(recorded: Recorded, from_ns: NDArray[np.int64], to_ns: NDArray[np.int64]) -> tuple[Array, Array]:
    """Returns tilt and direction of descent (n,), rad, of gravity's mean over stretches: the plate may move in them.

    Args:
        recorded: the recording.
        from_ns: (n,) when the stretches begin, ns.
        to_ns: (n,) when they end, ns.
    """
    gravity = recorded.plate.at(between(from_ns, to_ns, MEAN_POINTS)).gravity
    x, y, z = gravity.reshape(len(from_ns), MEAN_POINTS, 3).mean(axis=1).T
    return np.arctan2(np.hypot(x, y), -z), np.arctan2(y, x)


def between(from_ns: NDArray[np.int64], to_ns: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """Returns the middles (n count,), ns, of `count` equal parts of each time from `from_ns` (n,) to `to_ns` (n,)."""
    shares = (np.arange(count) + 0.5) / count
    return (from_ns[:, None] + np.round(shares * (to_ns - from_ns)[:, None]).astype(np.int64)).ravel()
