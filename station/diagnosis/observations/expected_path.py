"""The path of each window's nodes as it is expected, on which the laws of the picture are evaluated.

A law of the picture changes the acceleration that a path seems to have. On the window's own parabola that change would
have a share of the very noise that it is to explain, and the law would seem to make the noise smaller: a rolling
shutter, whose displacement grows with the velocity, turned the ways by it. Two of a hundred nulls had one
(`python -m tests.proof --family own --tier null:60,null_nuisance:40 --no-refits --seed 20261540`).
"""

from __future__ import annotations

import numpy as np

from station.diagnosis.observations.moments import Load
from station.diagnosis.observations.windows import WEIGHTS, Windows
from station.physics.contact import Array, unit


def expected_path(windows: Windows, plain: Load) -> tuple[Array, Array]:
    """Returns the places (3 n, 2), m, and velocities (3 n, 2), m/s, of the windows' nodes in P.

    Each of the `windows` (n,) goes on from its place and speed at the middle, which are independent of its
    acceleration's noise, in the direction of the `plain` loads' contact (3 n,), with the acceleration that they make at
    the friction of all windows.
    """
    count = len(windows)
    way_rad = plain.contact.way_rad.reshape(count, -1)[:, 1]
    way = unit(way_rad)
    along = _along(windows, plain, way)[:, None, None] * way[:, None, :]
    since_s = 1e-9 * (windows["node_ns"] - windows["node_ns"][:, 1:2])[..., None]
    start = plain.contact.speed_m_s.reshape(count, -1)[:, 1, None, None] * way[:, None, :]
    place = windows["node_pose"][:, 1:2, :2] + since_s * start + 0.5 * since_s**2 * along
    return place.reshape(-1, 2), (start + since_s * along).reshape(-1, 2)


def _along(windows: Windows, plain: Load, way: Array) -> Array:
    """Gives the acceleration (n,), m/s², by the windows' loads in their directions (n, 2) at their median friction."""
    pull = np.einsum("ijk,j,ik->i", plain.tangential.reshape(len(windows), -1, 2), WEIGHTS, way)
    normal = plain.normal.reshape(len(windows), -1) @ WEIGHTS
    friction = float(np.median((pull - (windows["acceleration_m_s2"] * way).sum(axis=1)) / normal))
    return np.asarray(pull - friction * normal, dtype=np.float64)
