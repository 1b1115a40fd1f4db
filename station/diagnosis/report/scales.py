"""The units in which people read covariates and residuals."""

from __future__ import annotations

import numpy as np

from station.diagnosis.observations.covariates import ANGLES, TITLES
from station.diagnosis.search.locate import READ_RESIDUALS_IN
from station.physics.contact import Array

_ANGLES = ANGLES | {"tilt", "tilt_rate"}
_SCALED = {
    "humidity": (100.0, "%"),
    "x": (1e3, "mm"),
    "y": (1e3, "mm"),
    "ahead": (1e3, "mm"),
    "previous_slide": (1e3, "mm"),
}
"""The factor and unit in which people read what is not told in its own."""
_UNITS = {
    "speed": "m/s",
    "slide_time": "s",
    "tilt_rate": "°/s",
    "step_time": "s",
    "temperature": "°C",
    "run": "number",
}
_RESIDUALS = READ_RESIDUALS_IN | {"relative friction": (100.0, "% of the friction")}
CHANNELS = {
    "onset": "friction at the onset",
    "along": "friction along the slide",
    "settling": "friction after a change of speed",
    "across": "sideways force",
    "turn": "turning",
    "rest": "place before the slip",
    "plate": "the plate's marks",
    "mount": "the plate's marks before each run",
    "shape": "the mark's shape",
}


def covariate(name: str, values: Array) -> tuple[Array, str]:
    """Returns the values (n,) of a covariate in the unit that people read, and the axis's label.

    `values` (n,) are in the covariate's own unit.
    """
    title = TITLES.get(name, {"x": "x on the plate", "y": "y on the plate", "all": "throughout"}.get(name, name))
    if name in _ANGLES:
        return np.degrees(values), f"{title} ({_UNITS.get(name, '°')})"
    if name in _SCALED:
        factor, unit = _SCALED[name]
        return factor * values, f"{title} ({unit})"
    if name == "dwell":
        return values, f"{title} (log₁₀ of seconds)"
    if name == "load":
        return 1e3 * np.exp(values), f"{title} (g)"
    unit = _UNITS.get(name, "")
    return values, f"{title} ({unit})" if unit else title


def residual(unit: str) -> tuple[float, str]:
    """Returns the factor and unit in which residuals of `unit` are shown."""
    return _RESIDUALS.get(unit, (1.0, unit))


def channel(name: str) -> str:
    """Returns a channel's title."""
    return CHANNELS.get(name, f"angle sensor {name.partition(':')[2]}")


def short(name: str) -> str:
    """Returns a covariate's title without its unit."""
    return covariate(name, np.zeros(0))[1].partition(" (")[0]
