"""The sliding direction and the angle of repose along it (paper, section IV, equations 2 to 6).

Symbols of the paper: t the tilting axis at the azimuth beta, alpha the plate's inclination, n its normal, d the
steepest way down, s the sliding direction in the world and s' the same as the camera sees it, in the plate's plane.
Angles of directions in the plate are measured from the plate's x towards its y, which runs up the image.

Two things differ from the paper's text, both misprints there: mu is tan theta (its equation 1 says arctan), and theta
is |arcsin s_z|, because a slide goes down and s_z is negative.

The steps of the paper's derivation agree with `station.rig.tilt`, which has them for one tilt; these take arrays.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
HALF_TURN = math.pi
FULL_TURN = 2 * math.pi
SQUARE_WITHIN = 0.05
"""A mark whose sides differ by less than this share has no short side that corner noise and foreshortening spare."""


def sliding_vector(slide_rad: ArrayLike, *, tilt_rad: ArrayLike, azimuth_rad: ArrayLike) -> Array:
    """Returns unit vectors s in the world, (n, 3): s = R(t, alpha) s' (equation 6), with t = R(k, beta) i (equation 2).

    Args:
        slide_rad: direction (n,) of s' in the plate.
        tilt_rad: alpha (n,).
        azimuth_rad: beta (n,).
    """
    slide, alpha, beta = (
        np.asarray(each, dtype=float)[..., None]
        for each in np.broadcast_arrays(*np.atleast_1d(slide_rad, tilt_rad, azimuth_rad))
    )
    nought = np.zeros_like(slide)
    seen = np.concatenate([np.cos(slide), np.sin(slide), nought], axis=-1)
    axis = np.concatenate([np.cos(beta), np.sin(beta), nought], axis=-1)
    along = np.sum(axis * seen, axis=-1, keepdims=True)
    # Rodrigues' formula for the turn by alpha about t.
    return seen * np.cos(alpha) + np.cross(axis, seen) * np.sin(alpha) + axis * along * (1 - np.cos(alpha))


def angle_of_repose(slide_rad: ArrayLike, *, tilt_rad: ArrayLike, azimuth_rad: ArrayLike) -> Array:
    """Returns theta (n,) in radians along the slide: |arcsin s_z| (equation 5).

    It is alpha itself where the block slid along d.
    """
    s = sliding_vector(slide_rad, tilt_rad=tilt_rad, azimuth_rad=azimuth_rad)
    return np.abs(np.arcsin(np.clip(s[..., 2], -1.0, 1.0)))


def friction_coefficient(theta_rad: ArrayLike) -> Array:
    """Returns mu = tan theta (n,), for every theta (n,) in radians."""
    return np.tan(np.asarray(theta_rad, dtype=float))


def slide_direction(pre: Array, post: Array) -> Array:
    """Gives the direction (n,), rad, of the mark's mean displacement from corners `pre` (n, 4, 2) to `post` (n, 4, 2).

    Both are in the plate frame P, m.
    """
    moved = (post - pre).mean(axis=1)
    return np.arctan2(moved[:, 1], moved[:, 0])


def mark_sides(corners: Array) -> Array:
    """Gives mean lengths (n, 2) of the mark's pairs of sides, along its x and y, in the unit of `corners` (n, 4, 2)."""
    edges = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    return np.column_stack([edges[:, [0, 2]].mean(axis=1), edges[:, [1, 3]].mean(axis=1)])


def yaw_of(corners: Array) -> Array:
    """Returns the yaw (n,), rad, in (−180°, 180°] of the mark in the plate, by corners (n, 4, 2) ordered by identity.

    The identity makes it unambiguous: the corners are the mark's (−, +), (+, +), (+, −), (−, −), as in
    `shared.geometry.mark_corners`, however the block is turned.
    """
    first, second, third, fourth = (corners[:, index] for index in range(4))
    x_axis, y_axis = second - first + third - fourth, first - fourth + second - third
    return np.arctan2(x_axis[:, 1] - y_axis[:, 0], x_axis[:, 0] + y_axis[:, 1])


@dataclass(frozen=True, slots=True)
class MarkShape:
    """The short axis of the mark; a square one has none."""

    short_is_y: bool
    square: bool


def mark_shape(corners: Array) -> MarkShape:
    """Returns the shape of a session's mark, from all its corners (n, 4, 2).

    It consists of medians, so that lost corners do not decide it.

    A square mark has no short side; its own x, known by its identity, then takes the part of X̂.
    """
    known = corners[np.isfinite(corners).all(axis=(1, 2))]
    if not len(known):
        return MarkShape(short_is_y=False, square=True)
    sides = mark_sides(known)
    ratio = float(np.median(sides[:, 1] / sides[:, 0]))
    square = abs(ratio - 1) < SQUARE_WITHIN
    return MarkShape(short_is_y=not square and ratio < 1, square=square)


def local_x_axis(yaw_rad: ArrayLike, *, short_is_y: bool = False) -> Array:
    """Returns the direction (n,) of the paper's X̂ in the plate, in radians, in (−90°, 90°].

    X̂ lies along the mark's short side and points along the camera's positive x, so that it is always on the same
    line of the mark, but flips its direction as the mark turns.
    """
    line = np.asarray(yaw_rad, dtype=float) + (math.pi / 2 if short_is_y else 0.0)
    return -((-line + math.pi / 2) % math.pi - math.pi / 2)


def paper_direction(slide_rad: ArrayLike, *, x_axis_rad: ArrayLike) -> Array:
    """Returns the direction (n,) of the slide against X̂, in [0°, 180°), in radians.

    A direction that points to a negative Ŷ is mirrored.

    The mirror is the paper's, point by point: a direction and its opposite become one, so one-way friction is lost.
    """
    relative = turn(np.asarray(slide_rad, dtype=float) - np.asarray(x_axis_rad, dtype=float))
    mirrored = np.where(relative >= HALF_TURN, relative - HALF_TURN, relative)
    return cast(Array, mirrored)


def turn(angle_rad: ArrayLike) -> Array:
    """Returns angles (n,) brought to [0°, 360°), in radians."""
    return np.asarray(angle_rad, dtype=float) % FULL_TURN
