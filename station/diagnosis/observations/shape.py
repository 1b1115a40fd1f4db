"""The channel of the mark's shape: the strain of its image along the block's path, less what the mark itself has."""

from __future__ import annotations

import numpy as np

from station.compiled import compiled
from station.diagnosis import thresholds
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

    A mark is never printed exactly: what all views share beside a model's strain is the mark's own. The mean corners
    seen in P are `corner_m` (n, 4, 2), m, and `mark_m` (4, 2) those of the mark as it should be, in the block's axes;
    `spread_m` (n, 2) is the root mean square way of the mark along its path in the view's frames.
    """

    name: str = "shape"
    title: str = "the mark's shape"
    phase: str = "camera at rest"
    unit: str = "1"
    trusted: float = thresholds.STRAIN_TRUSTED

    def __init__(self, rows: Rows, corner_m: Array, *, mark_m: Array, view: View, spread_m: Array) -> None:
        super().__init__(rows)
        self._corner, self._view, self._spread = corner_m, view, spread_m[:, None, :]
        self._gradient = gradient_per_m(mark_m)
        self._precision = 1.0 / np.square(rows.sigma[::3])

    def changed_by(self, effect: Effect) -> bool:
        """Returns false for what moves a mark as a whole."""
        return super().changed_by(effect) and effect.strains

    def residual(self, model: Model) -> Array:
        """Returns the strain (3 n,) that is left of the mark where the model says that its corners were."""
        seen_by = any(self.changed_by(term.effect) for term in model.acting("seen"))
        strain = strain_of(self._true(model) if seen_by else self._corner, self._gradient)
        return (strain - common(strain, self._precision)).ravel()

    def _true(self, model: Model) -> Array:
        """Returns the corners' true places (n, 4, 2), m: those seen, less their displacement there.

        The displacement is the mean at two places on the path, whose mean and spread are those of the view's frames.
        """
        true = self._corner
        for _ in range(TRUE_ROUNDS):
            true = self._corner - model.seen(self._view.of(true))
        ahead, behind = (model.seen(self._view.of(true + way)) for way in (self._spread, -self._spread))
        return self._corner - 0.5 * (ahead + behind)


def gradient_per_m(mark_m: Array) -> Array:
    """Returns the gradient of least squares by each corner's place.

    It is (4, 2), in 1/m, of a mark with corners `mark_m` (4, 2), m.

    With the corners r about their mean and their second moment S, a corner at d adds d rᵀ S⁻¹.
    """
    about = mark_m - mark_m.mean(axis=0)
    return about @ np.linalg.inv(about.T @ about)


def strain_of(corner_m: Array, gradient: Array) -> Array:
    """Returns Green's strain (n, 3: xx, yy, xy), in the mark's own axes, of its corners `corner_m`; no turn changes it.

    The strain by displacements from a rigid mark, fitted to the sheared one, is off by three eighths of the shear's
    square: more than the noise of a slide at .1 m/s.

    Args:
        corner_m: (n, 4, 2) the corners, m.
        gradient: (4, 2) that of `gradient_per_m`, 1/m.
    """
    bent = np.einsum("nki,kj->jin", corner_m, gradient)
    (x_x, x_y), (y_x, y_y) = bent
    return 0.5 * np.column_stack([x_x**2 + x_y**2 - 1.0, y_x**2 + y_y**2 - 1.0, x_x * y_x + x_y * y_y])


@compiled
def common(values: Array, precision: Array) -> Array:
    """Returns the (k,) that the rows of `values` (n, k) have in common.

    It is the maximum likelihood of Student's t with 3 degrees of freedom. Its weights change smoothly with the values,
    so that a fit has slopes. The difference of two medians of skew values, as a lens makes them, was off by a per cent
    of the lens (tests/unit/diagnosis/test_image_rows.py).

    Where the noise grows during a session, the mean of all rows is off by more than the best of them are, which then
    seem to share a strain.

    Args:
        values: (n, k) the rows, in any unit.
        precision: (n,) the rows' inverse variances up to a factor.
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
