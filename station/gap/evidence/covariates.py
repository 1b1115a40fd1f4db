"""What could explain a residual, by the names that reports use."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from station.physics.contact import Array, Contact

ANGLES = frozenset({"previous_direction", "turned", "direction", "yaw", "slide_to_block", "slide_to_grain"})
"""Covariates that are angles: what depends on them is periodic."""

PLACES = ("x", "y")
"""Two covariates that belong together: the place on the plate."""

TITLES = {
    "direction": "tilt direction",
    "yaw": "block's yaw",
    "slide_to_block": "direction against the block",
    "slide_to_grain": "direction against the plate's grain",
    "position": "place on the plate",
    "ahead": "place along the slide's direction",
    "previous_direction": "direction of the run before",
    "turned": "direction against that of the run before",
    "previous_slide": "length of the slide before",
    "since_handled": "runs since the block was put back",
    "speed": "speed",
    "slide_time": "time since the onset",
    "tilt": "tilt",
    "tilt_rate": "tilt rate",
    "dwell": "time at rest",
    "run": "run number",
    "load": "block's mass",
    "temperature": "temperature",
    "humidity": "relative humidity",
    "rising": "tilt growing or falling",
}


def covariates_of(contact: Contact) -> Mapping[str, Array]:
    """All covariates of contacts (n,); those that are unknown or do not vary are for the reader to leave out."""
    moving = contact.moving
    rate = np.linalg.norm(contact.rate_rad_s, axis=1)
    return {
        "direction": contact.down_rad,
        "yaw": contact.yaw_rad,
        "slide_to_block": contact.way_rad - contact.yaw_rad,
        "slide_to_grain": contact.way_rad - contact.mount_rad,
        "x": contact.x_m,
        "y": contact.y_m,
        "ahead": contact.x_m * np.cos(contact.way_rad) + contact.y_m * np.sin(contact.way_rad),
        "speed": np.where(moving, contact.speed_m_s, np.nan),
        "slide_time": np.where(moving, contact.slid_s, np.nan),
        "tilt": np.where(moving, contact.tilt_rad, np.nan),
        "tilt_rate": rate * np.where(contact.rising < 0, -1.0, 1.0),
        "dwell": np.log10(np.maximum(contact.rest_s, 1e-3)),
        "run": contact.run,
        "load": np.log(np.maximum(contact.mass_kg, 1e-9)),
        "temperature": contact.temperature_c,
        "humidity": contact.relative_humidity,
    }
