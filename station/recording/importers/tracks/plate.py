"""The plate's attitude in a table of tracks, as quaternions world_from_plate."""

from __future__ import annotations

import math

import numpy as np

from shared.errors import UserError
from shared.geometry import Array
from shared.possible import SHORTEST
from station.recording.importers.tracks.table import Tracks
from station.recording.importers.tracks.units import PLATE


def attitude(table: Tracks) -> Array:
    """Returns the plate's unit quaternions (n, 4), world_from_plate, real part first.

    Raises:
        UserError: without an attitude, with a tilt that has no azimuth, or with rows that have none.
    """
    if table.has(*PLATE) and "tilt" in table:
        raise UserError(
            f"Expected the plate's attitude once in {table.source}, got it in tilt_rad and in plate_qw to plate_qz; "
            "leave one of them out"
        )
    if table.has(*PLATE):
        return _of_quaternions(table)
    if "tilt" not in table:
        raise UserError(
            f"Expected the plate's attitude in {table.source}, tilt_rad with azimuth_rad or plate_qw to plate_qz, "
            "found none; a level plate has tilt_rad = 0 in every row"
        )
    tilt = _known(table, "tilt")
    if "azimuth" not in table and tilt.any():
        raise UserError(
            f"Expected azimuth_rad beside tilt_rad in {table.source}, found none; it is the direction of the "
            "tilt's axis in the plate, and downhill is (sin azimuth, -cos azimuth)"
        )
    azimuth = _known(table, "azimuth") if "azimuth" in table else np.zeros(len(table))
    half = np.sin(0.5 * tilt)
    return np.column_stack([np.cos(0.5 * tilt), half * np.cos(azimuth), half * np.sin(azimuth), np.zeros(len(table))])


def _of_quaternions(table: Tracks) -> Array:
    found = np.column_stack([_known(table, name) for name in PLATE])
    length = np.linalg.norm(found, axis=1, keepdims=True)
    if (length < SHORTEST).any():
        row = int(np.argmin(length)) + 1
        raise UserError(
            f"{table.source}, row {row}: expected a unit quaternion in plate_qw to plate_qz, got a shorter one"
        )
    return found / length


def _known(table: Tracks, quantity: str) -> Array:
    """Returns the values (n,); one that is told once in a run holds throughout it, as of a plate that does not turn."""
    values, run = table.numbers[quantity].copy(), table.numbers["run"]
    for one in np.unique(run[np.isnan(values)]):
        own = run == one
        given = np.flatnonzero(own & np.isfinite(values))
        if len(given) == 1:
            values[own] = values[given[0]]
    if np.isnan(values).any():
        row = int(np.flatnonzero(np.isnan(values))[0]) + 1
        raise UserError(f"{table.source}, row {row}: expected the plate's attitude in every row, got no {quantity}")
    return values


def tilt_of(quaternion: Array) -> Array:
    """Returns the tilts (n,), rad, of unit quaternions `quaternion` (n, 4), world_from_plate, real part first."""
    return 2.0 * np.arcsin(np.minimum(1.0, np.hypot(quaternion[:, 1], quaternion[:, 2])))


def downhill_of(quaternion: Array) -> Array:
    """Returns the directions (n, 2) of the steepest descent in the plate; (0, 0) on a level plate.

    `quaternion` (n, 4) has unit quaternions, world_from_plate, real part first.
    """
    w, x, y, z = quaternion.T
    down = np.column_stack([w * y - x * z, -y * z - w * x])
    length = np.linalg.norm(down, axis=1, keepdims=True)
    return np.where(length > 0.0, down / np.maximum(length, 1e-300), 0.0)


def azimuth_of(downhill: Array) -> float:
    """Gives the azimuth of the tilt's axis, rad, for the direction `downhill` (2,) of steepest descent in the plate."""
    return math.atan2(float(downhill[0]), -float(downhill[1]))
