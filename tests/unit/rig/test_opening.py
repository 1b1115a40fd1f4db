"""The room that a block has in an opening, against distances of points all along both outlines."""

from __future__ import annotations

import math

import numpy as np
import pytest

from station.physics.contact import Array
from station.rig.opening import Opening
from station.rig.outline import room_within

CORNERED = np.array([(-0.04, -0.04), (0.04, -0.04), (0.04, 0.0), (0.0, 0.0), (0.0, 0.04), (-0.04, 0.04)])
"""An opening whose foam points inwards at the middle."""

Pose = tuple[float, float, float]


def along(outline_m: Array, count: int = 400) -> Array:
    """Points all along an outline (n, 2)."""
    sides = zip(outline_m, np.roll(outline_m, -1, axis=0), strict=True)
    return np.concatenate([np.linspace(begin, end, count) for begin, end in sides])


def block(x: float, y: float, yaw: float) -> Array:
    """The outline of a block with sides of 10 mm."""
    turn = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
    return 0.005 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) @ turn.T + np.array([x, y])


def room(x: float, y: float, yaw: float) -> tuple[float, Array]:
    """The distance from the outline, m, and the way back (2,)."""
    pose = (np.array([x]), np.array([y]), np.array([yaw]))
    found, way = room_within(CORNERED, np.array([0.005]), pose)
    return float(found[0]), way[0]


@pytest.mark.parametrize(
    "pose", [(-0.02, -0.02, 0.3), (-0.03, 0.02, 1.0), (-0.01, -0.01, math.pi / 4), (0.03, -0.03, 0.0)]
)
def test_the_room_is_the_least_distance_of_both_outlines(pose: Pose) -> None:
    apart = np.linalg.norm(along(block(*pose))[:, None] - along(CORNERED)[None], axis=-1).min()
    assert room(*pose)[0] == pytest.approx(apart, abs=3e-5)


@pytest.mark.parametrize("pose", [(-0.038, -0.02, 0.2), (0.02, -0.004, 0.0), (-0.002, -0.003, math.pi / 4)])
def test_a_block_in_the_foam_is_led_out_by_as_much_as_it_is_in(pose: Pose) -> None:
    """Also one that leans on the corner of foam which points into the opening."""
    inside, way = room(*pose)
    assert inside < 0.0
    x, y, yaw = pose
    assert room(x - inside * way[0], y - inside * way[1], yaw)[0] == pytest.approx(0.0, abs=1e-9)


def test_the_largest_free_circle_is_known() -> None:
    square = Opening(outline_m=((-0.04, -0.03), (0.04, -0.03), (0.04, 0.03), (-0.04, 0.03)))
    assert square.free_radius_m == pytest.approx(0.03)
    assert Opening(radius_m=0.045).free_radius_m == 0.045
    assert square.walled
    assert not Opening().walled
