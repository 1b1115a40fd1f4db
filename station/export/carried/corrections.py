"""Corrects plate and camera where a model says that they differ from what they report."""

from __future__ import annotations

from typing import Any

from station.export.carried.states import contact, view
from station.physics.contact import Array
from station.physics.model import Model
from station.physics.turned import seen_turned


def true_gravity(model: Model, gravity: Array, **said: Any) -> Array:
    """Returns gravity (3,) in the frame of the plate as it truly stands, in the unit of `gravity`.

    `gravity` (3,), in any unit, is that in the plate as the arm reports it.
    """
    return seen_turned(gravity, model.attitude(contact(**said))[0])


def seen_corners(model: Model, corners_m: Any, *, tilt_rad: float, down_rad: float, **said: Any) -> Array:
    """Returns the places (4, 2), m, where a camera sees the corners of a mark that truly is at `corners_m`.

    See `view` for the arguments.
    """
    seen = view(corners_m, tilt_rad=tilt_rad, down_rad=down_rad, **said)
    return (seen.point_m + model.seen(seen))[0]


def stamp_s(model: Model, time_s: float) -> float:
    """Returns the stamp, s, that the camera gives to what happens at `time_s`."""
    return time_s + model.delay_s()
