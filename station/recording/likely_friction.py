"""Refuses a table of friction whose usual numbers no bench has: slips of unit, with what was probably meant."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from shared.errors import UserError
from shared.geometry import Array
from shared.likely import TILT_RAD

MOST_COEFFICIENT = 5.0
"""The most that friction usually is of its load: soft rubber on clean glass has some 4. Where adhesion holds a tiny
load, and it is more, the table can have `friction_force_n` and `normal_load_n` instead."""


def refuse_unlikely_friction(onset_rad: Array, coefficient: Array, path: Path) -> None:
    """Refuses a table whose onsets are mostly beyond the vertical, or its coefficients mostly beyond all friction.

    Single rows of that kind are mistakes of their own.

    Args:
        onset_rad: (n,) the onsets, rad; 0 or nan where a row has none.
        coefficient: (n,) the coefficients of friction; nan where a row has none.
        path: the table, for messages.

    Raises:
        UserError: with the middle one of the numbers, and the unit that was probably meant.
    """
    usual_rad, usual = _usual(onset_rad), _usual(coefficient)
    if usual_rad > TILT_RAD:
        raise UserError(
            f"{path}: expected at most {TILT_RAD:.4g} rad in 'onset_angle_rad', as no plate is tilted beyond the "
            f"vertical, got {usual_rad:.4g} rad as the median; did you mean degrees? Multiply them by pi/180"
        )
    if usual > MOST_COEFFICIENT:
        raise UserError(
            f"{path}: expected at most {MOST_COEFFICIENT:g} in 'friction_coefficient', as even rubber on glass has "
            f"less, got {usual:.4g} as the median; did you mean per cent? Divide them by 100"
        )


def _usual(values: Array) -> float:
    """Returns the median of the values above 0; 0 without any."""
    known = values[values > 0]
    return float(np.median(known)) if len(known) else 0.0
