"""The covariates on which friction may depend, read from a contact, by the names that reports use."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from station.physics.contact import Array, Contact


def _ahead(contact: Contact) -> Array:
    return contact.x_m * np.cos(contact.way_rad) + contact.y_m * np.sin(contact.way_rad)


def _tilt_rate(contact: Contact) -> Array:
    rate = np.linalg.norm(contact.rate_rad_s, axis=1)
    return rate * np.where(contact.rising < 0, -1.0, 1.0)


READ: Mapping[str, Callable[[Contact], Array]] = MappingProxyType(
    {
        "direction": lambda contact: contact.down_rad,
        "yaw": lambda contact: contact.yaw_rad,
        "slide_to_block": lambda contact: contact.way_rad - contact.yaw_rad,
        "slide_to_grain": lambda contact: contact.way_rad - contact.mount_rad,
        "x": lambda contact: contact.x_m,
        "y": lambda contact: contact.y_m,
        "ahead": _ahead,
        "speed": lambda contact: np.where(contact.moving, contact.speed_m_s, np.nan),
        "slide_time": lambda contact: np.where(contact.moving, contact.slid_s, np.nan),
        "tilt": lambda contact: np.where(contact.moving, contact.tilt_rad, np.nan),
        "tilt_rate": _tilt_rate,
        "dwell": lambda contact: np.log10(np.maximum(contact.rest_s, 1e-3)),
        "run": lambda contact: contact.run,
        "load": lambda contact: np.log(np.maximum(contact.mass_kg, 1e-9)),
        "temperature": lambda contact: contact.temperature_c,
        "humidity": lambda contact: contact.relative_humidity,
    }
)
"""The function that reads each covariate (n,) from a contact; it gives nan where that is unknown or meaningless."""


def covariates_of(contact: Contact) -> Mapping[str, Array]:
    """Returns all covariates (n,) by name, also those that are unknown or do not vary."""
    return {name: read(contact) for name, read in READ.items()}
