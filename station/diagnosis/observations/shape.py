"""The channel of the mark's shape: the strain of its image along the block's path, less what the mark itself has."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.compiled import compiled
from station.diagnosis.observations.channel import Channel, Rows
from station.physics.contact import Array, View
from station.physics.effect import Effect
from station.physics.model import Model

COMMON_ROUNDS = 8
TRUE_ROUNDS = 2
"""A lens of a twentieth leaves a thousandth of itself after one round, and a thirtieth of that after another."""
LEAST_PULL = 1e-6
"""Strains that are equal to so much of their noise have no scatter to divide by."""


class Shape(Channel):
    """Strain of the mark's image in the block's axes (xx, yy, xy: three rows a view), less the mark's own.

    A mark is never printed exactly: what all views share beside a model's strain is the mark's own. `spread_m` (n, 2)
    is the root mean square way of the mark along its path in the view's frames, over which the strain is a mean.
    """

    name: str = "shape"
    title: str = "the mark's shape"
    phase: str = "camera at rest"
    unit: str = "1"
    trusted: float = thresholds.STRAIN_TRUSTED

    def __init__(self, rows: Rows, strain: Array, view: View, yaw_rad: Array, spread_m: Array) -> None:
        super().__init__(rows)
        self._strain, self._view, self._spread = strain, view, spread_m[:, None, :]
        self._per_m = strain_per_m(view.point_m, yaw_rad)
        self._precision = 1.0 / np.square(rows.sigma[:: strain.shape[1]])

    def changed_by(self, effect: Effect) -> bool:
        """False for what moves a mark as a whole."""
        return super().changed_by(effect) and effect.strains

    def residual(self, model: Model) -> Array:
        """Recorded minus predicted strain (3 n,)."""
        strain = self._strain
        if any(self.changed_by(term.effect) for term in model.acting("seen")):
            strain = strain - strain_by(self._seen(model), self._per_m)
        return (strain - common(strain, self._precision)).ravel()

    def _seen(self, model: Model) -> Array:
        """The corners' displacement (n, 4, 2), m, at the mark's true place; the view has its apparent one.

        It is the mean of two places on the path, whose mean and spread are those of the view's frames.
        """
        seen, true = self._view.point_m, self._view.point_m
        for _ in range(TRUE_ROUNDS):
            true = seen - model.seen(replace(self._view, point_m=true)).mean(axis=1, keepdims=True)
        ahead, behind = (model.seen(replace(self._view, point_m=true + way)) for way in (self._spread, -self._spread))
        return 0.5 * (ahead + behind)


@compiled
def common(values: Array, precision: Array) -> Array:
    """The (k,) that the rows of `values` (n, k) have in common: the maximum likelihood of Student's t with 3 degrees.

    `precision` (n,) are the rows' inverse variances up to a factor: where the noise grows during a session, the mean of
    all rows is off by more than the best of them are, which then seem to share a strain.

    Its weights change smoothly with the values, so that a fit has slopes. The difference of two medians of skew values,
    as a lens makes them, was off by a per cent of the lens (tests/unit/diagnosis/test_image_rows.py).
    """
    middle = np.empty(values.shape[1])
    for k in range(values.shape[1]):
        column = values[:, k]
        middle[k] = np.median(column)
        for _ in range(COMMON_ROUNDS):
            off = precision * np.square(column - middle[k])
            weight = precision / (1.0 + off / max(3.0 * off.mean(), LEAST_PULL**2))
            middle[k] = (weight * column).sum() / weight.sum()
    return middle


def strain_of(model_m: Array, seen_m: Array, yaw_rad: Array) -> Array:
    """Strain (n, 3: xx, yy, xy), in the block's axes, of a mark's corners as seen against those of a rigid mark.

    `seen_m` (n, 4, 2) and `model_m` (n, 4, 2) are in P, m, and the block's heading there is `yaw_rad` (n,), rad.
    """
    return strain_by(seen_m - model_m, strain_per_m(model_m, yaw_rad))


def strain_by(moved_m: Array, per_m: Array) -> Array:
    """Strain (n, 3) of a mark whose corners are `moved_m` (n, 4, 2), m, by `per_m` (n, 3, 4, 2), see `strain_per_m`."""
    return np.einsum("nskc,nkc->ns", per_m, moved_m)


def strain_per_m(model_m: Array, yaw_rad: Array) -> Array:
    """The strains (xx, yy, xy) by each corner's displacement along x and y: (n, 3, 4, 2), 1/m.

    `model_m` (n, 4, 2), m, are a rigid mark's corners in P, and `yaw_rad` (n,) is the block's heading there. The
    gradient is that of least squares: with the corners r about their mean, in the block's axes, and their second moment
    S, a displacement d of one corner adds d rᵀ S⁻¹.
    """
    cosine, sine = np.cos(yaw_rad), np.sin(yaw_rad)
    turn = np.stack([np.stack([cosine, sine], axis=-1), np.stack([-sine, cosine], axis=-1)], axis=-2)
    rigid = np.einsum("nij,nkj->nki", turn, model_m - model_m.mean(axis=1, keepdims=True))
    weight = rigid @ np.linalg.inv(np.einsum("nki,nkj->nij", rigid, rigid))
    along_x, along_y = np.einsum("nkj,nic->njikc", weight, turn).swapaxes(0, 1)
    return np.stack([along_x[:, 0], along_y[:, 1], 0.5 * (along_y[:, 0] + along_x[:, 1])], axis=1)
