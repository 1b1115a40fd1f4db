"""Gravity in the plate frame from what the sensors say about their attitude.

Three conventions meet here: ours (z up, the plate's normal), MAVLink's (forward, right, down) and Motive's (y up or
z up). How a sensor is turned on the plate is `plate_from_sensor`, from the option `mount_rpy_deg` of its table.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from shared.geometry import matrix_from_quaternion
from station.angles.reading import Vector
from station.rig.arm_model import transform

Array = NDArray[np.float64]


def mount_rotation(rpy_deg: Vector) -> Array:
    """Gives plate_from_sensor, (3, 3) = Rz(yaw) Ry(pitch) Rx(roll), of a sensor whose own frame has z up when level."""
    roll, pitch, yaw = (math.radians(angle) for angle in rpy_deg)
    return transform((0.0, 0.0, 0.0), (roll, pitch, yaw))[:3, :3]


def gravity_of_attitude(qw: float, qx: float, qy: float, qz: float) -> Vector:
    """Returns gravity in the body's frame from world_from_body, the world's z up: minus the rotation's third row."""
    square = qw * qw + qx * qx + qy * qy + qz * qz
    x, y = 2 * (qw * qy - qx * qz) / square, -2 * (qw * qx + qy * qz) / square
    return (x, y, 2 * (qx * qx + qy * qy) / square - 1)


def gravity_of_aeronautical(roll_rad: float, pitch_rad: float) -> Vector:
    """Returns gravity in a sensor's forward-left-up frame from MAVLink's roll and pitch (forward-right-down, ZYX).

    In the forward-right-down frame it is (−sin p, cos p sin r, cos p cos r).
    """
    return (
        -math.sin(pitch_rad),
        -math.cos(pitch_rad) * math.sin(roll_rad),
        -math.cos(pitch_rad) * math.cos(roll_rad),
    )


def gravity_of_motive(qx: float, qy: float, qz: float, qw: float, *, up_axis: str) -> Vector:
    """Gives gravity in a rigid body's frame with z up, by Motive's quaternion (x, y, z, w) and its up axis, "y" or "z".

    A rigid body's axes are Motive's at the moment when it is made; with y up, our x, y, z are Motive's x, −z, y.
    """
    rotation = matrix_from_quaternion((qw, qx, qy, qz))
    if up_axis == "z":
        return _vector(-rotation[2])
    x, y, z = _vector(-rotation[1])
    return (x, -z, y)


def on_plate(gravity: Vector, *, plate_from_sensor: Array) -> Vector:
    """Gives gravity's unit vector (3,) in the plate frame, by the one in the sensor's and plate_from_sensor (3, 3)."""
    return _vector(plate_from_sensor @ np.array(gravity))


def _vector(values: Array) -> Vector:
    x, y, z = values.tolist()
    return (x, y, z)
