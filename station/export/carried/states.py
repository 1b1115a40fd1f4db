"""The states that a model is asked about, with a usual value for all that is not said."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from station.physics.contact import Contact, View

USUAL: dict[str, Any] = {
    "run": 0.0,
    "moving": False,
    "way_rad": 0.0,
    "speed_m_s": 0.0,
    "x_m": 0.0,
    "y_m": 0.0,
    "yaw_rad": 0.0,
    "rest_s": 10.0,
    "slid_s": 0.0,
    "tilt_rad": 0.3,
    "down_rad": 0.0,
    "rate_rad_s": (0.0, 0.0, 0.0),
    "acceleration_rad_s2": (0.0, 0.0, 0.0),
    "rising": 1.0,
    "gone_rad": math.inf,
    "swing_rad": (math.inf, math.inf, math.inf),
    "step_s": 0.0,
    "mount_rad": 0.0,
    "mass_kg": 0.00785,
    "area_m2": 1e-4,
    "border_m": math.inf,
    "temperature_c": math.nan,
    "relative_humidity": math.nan,
    "spare_m_s2": math.nan,
}
"""A steel cube of 10 mm at rest in the middle of a plate that is tilted by 17°, towards +x."""
_VECTORS = ("rate_rad_s", "acceleration_rad_s2", "swing_rad")


def contact(**said: Any) -> Contact:
    """Returns the block on the plate at as many moments as the longest of the fields that are `said`; see `Contact`."""
    counts = [len(value) for name, value in said.items() if np.ndim(value) == (2 if name in _VECTORS else 1)]
    n = max(counts, default=1)
    return Contact(
        **{
            name: np.full(
                (n, 3) if name in _VECTORS else n, said.get(name, usual), dtype=bool if name == "moving" else float
            )
            for name, usual in USUAL.items()
        }
    )


def view(corners_m: Any, *, tilt_rad: float, down_rad: float, **said: Any) -> View:
    """Returns a camera's view of a mark's four corners (4, 2), m, in the plate.

    See `View` for what else may be `said`.
    """
    corners = np.asarray(corners_m, dtype=float)[None]
    usual: dict[str, Any] = {
        "on_block": True,
        "velocity_m_s": np.zeros((1, 2)),
        "yaw_rate_rad_s": np.zeros(1),
        "rest_s": np.full(1, USUAL["rest_s"]),
        "limit_rad": np.full(1, math.nan),
        "side_m": float(np.linalg.norm(corners[0, 1] - corners[0, 0])),
        "camera_height_m": 0.3,
        "image_centre_m": np.zeros(2),
        "row_m": np.array([0.0, -1.0]),
        "image_size_m": 0.2,
    }
    return View(point_m=corners, tilt_rad=np.full(1, tilt_rad), down_rad=np.full(1, down_rad), **{**usual, **said})
