"""Computes how MuJoCo lays the tangents of a contact, and how far an ellipse turns with it.

`mju_makeFrame` (MuJoCo 4.0) has only the contact's normal n to go by. The first tangent is the world's y axis laid into
the contact's plane; where |n_y| >= 1/2 it is the world's z axis instead. It follows neither body. A pair's first
friction coefficient belongs to the first tangent, the second to n × t_1.
"""

from __future__ import annotations

import math

import numpy as np

from station.export.measured import Array

STEEPEST_NY = 0.5
"""|n_y| from which MuJoCo takes z in place of y."""


def first_tangent(normal: Array) -> Array:
    """Returns the first tangent (3,) of a contact with this unit normal (3,), in the world's frame."""
    axis = np.array([0.0, 1.0, 0.0] if abs(normal[1]) < STEEPEST_NY else [0.0, 0.0, 1.0])
    tangent = axis - (normal @ axis) * normal
    return tangent / np.linalg.norm(tangent)


def ellipse_turn_rad(tilt_rad: float, azimuth_rad: float) -> float:
    """Returns the turn (−90° to 90°) of the ellipse on a plate that was tilted by `tilt_rad` about a level axis.

    The axis of the tilt is at the azimuth from the world's x; level, the ellipse's first axis is the world's y.
    """
    rotation = _rotation(tilt_rad, azimuth_rad)
    x, y, _ = rotation.T @ first_tangent(rotation[:, 2])
    turn = math.atan2(y, x) - math.pi / 2
    return (turn + math.pi / 2) % math.pi - math.pi / 2


def worst_turn_rad(tilt_rad: float) -> float:
    """Returns the largest turn of the ellipse at one tilt, over all axes of the tilt."""
    return max(abs(ellipse_turn_rad(tilt_rad, math.radians(azimuth))) for azimuth in range(180))


def _rotation(angle_rad: float, azimuth_rad: float) -> Array:
    """Returns the rotation about a level axis, by Rodrigues' formula."""
    x, y = math.cos(azimuth_rad), math.sin(azimuth_rad)
    cross = np.array([[0.0, 0.0, y], [0.0, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle_rad) * cross + (1 - math.cos(angle_rad)) * cross @ cross
