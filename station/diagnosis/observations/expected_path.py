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


def expected_path(windows: Windows, plain: Load) -> tuple[Array, Array, Array]:
    """Returns places (3 n, 2), m, velocities (3 n, 2), m/s, and accelerations (3 n, 2), m/s², of the nodes in P.

    Each of the `windows` (n,) goes on from its place and speed at the middle, which are independent of its
    acceleration's noise, in the direction of the `plain` loads' contact (3 n,), with the accelerations that they make
    at the friction of all windows: a plate that turns back lets a block gain 7 m/s³ less and less, and a read-out row
    by row shows that as a turn of the mark.
    """
    count = len(windows)
    way = unit(plain.contact.way_rad.reshape(count, -1)[:, 1])
    at_nodes, mean = _along(windows, plain, way)
    since_s = 1e-9 * (windows["node_ns"] - windows["node_ns"][:, 1:2])
    gaining = (at_nodes[:, -1] - at_nodes[:, 0]) / (since_s[:, -1] - since_s[:, 0])
    since_s, way = since_s[..., None], way[:, None, :]
    gain, more = mean[:, None, None] * way, gaining[:, None, None] * way
    start = plain.contact.speed_m_s.reshape(count, -1)[:, 1, None, None] * way
    place = windows["node_pose"][:, 1:2, :2] + since_s * (start + since_s * (gain / 2.0 + since_s * more / 6.0))
    velocity, gained = start + since_s * (gain + since_s * more / 2.0), gain + since_s * more
    return place.reshape(-1, 2), velocity.reshape(-1, 2), gained.reshape(-1, 2)


def _along(windows: Windows, plain: Load, way: Array) -> tuple[Array, Array]:
    """Gives the acceleration at the nodes (n, 3) and its mean (n,), m/s², by the loads at the windows' median friction.

    They are those in the windows' directions `way` (n, 2).
    """
    pull = np.einsum("ijk,ik->ij", plain.tangential.reshape(len(windows), -1, 2), way)
    normal = plain.normal.reshape(len(windows), -1)
    recorded = (windows["acceleration_m_s2"] * way).sum(axis=1)
    friction = float(np.median((pull @ WEIGHTS - recorded) / (normal @ WEIGHTS)))
    gained = pull - friction * normal
    return gained, gained @ WEIGHTS
