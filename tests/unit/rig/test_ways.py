"""The way of a block up to the foam, against small steps along it, and what foam holds."""

from __future__ import annotations

import math

import numpy as np
import pytest

from station.rig.opening import TOUCH_M, Opening, square_corners

HALF_M = 0.005
ROUND = Opening(radius_m=0.045)
CORNERED = Opening(outline_m=((-0.04, -0.04), (0.04, -0.04), (0.04, 0.0), (0.0, 0.0), (0.0, 0.04), (-0.04, 0.04)))
"""An opening whose foam points inwards at the middle."""


def way(opening: Opening, pose: tuple[float, float, float], towards_deg: float) -> float:
    angle = math.radians(towards_deg)
    return float(opening.way_m(square_corners(HALF_M, pose), np.array([[math.cos(angle), math.sin(angle)]]))[0])


def room(opening: Opening, pose: tuple[float, float, float]) -> float:
    return float(opening.room_m(np.array([HALF_M]), tuple(np.array([value]) for value in pose))[0])  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("opening", [ROUND, CORNERED], ids=["round", "cornered"])
def test_the_way_ends_where_no_room_is_left(opening: Opening) -> None:
    rng = np.random.default_rng(1)
    seen = 0
    while seen < 40:
        x, y = rng.uniform(-0.035, 0.035, 2).tolist()
        yaw, towards = float(rng.uniform(-3, 3)), float(rng.uniform(0, 360))
        if room(opening, (x, y, yaw)) < 2 * TOUCH_M:
            continue
        seen += 1
        found, step = (
            way(opening, (x, y, yaw), towards),
            np.array([math.cos(np.radians(towards)), math.sin(np.radians(towards))]),
        )
        for share in np.linspace(0.0, 1.0, 30):
            px, py = np.array([x, y]) + share * found * step
            assert room(opening, (px, py, yaw)) > -1e-9
        px, py = np.array([x, y]) + (found + 2e-4) * step
        assert room(opening, (px, py, yaw)) < 0.0


@pytest.mark.parametrize(
    ("towards_deg", "held"), [(0, True), (60, True), (90, True), (110, True), (130, False), (180, False)]
)
@pytest.mark.parametrize("depth_m", [-0.0005, 0.0, 0.0005])
@pytest.mark.parametrize("wall", [ROUND, CORNERED], ids=["round", "cornered"])
def test_foam_holds_what_is_not_pulled_away_by_more_than_its_friction(
    wall: Opening, depth_m: float, towards_deg: float, held: bool
) -> None:
    """The block touches the foam at its right with one corner, and is pulled at an angle from there."""
    edge, y = (0.045, 0.0) if wall is ROUND else (0.04, -0.02)
    pose = (edge + depth_m - math.sqrt(2) * HALF_M, y, math.pi / 4)
    assert wall.touches(square_corners(HALF_M, pose))[0]
    assert (way(wall, pose, towards_deg) == 0.0) is held


def test_a_block_that_leans_on_a_corner_of_foam_is_held_there() -> None:
    """The foam's corner points into the opening, and meets a side of the block between its corners."""
    assert way(CORNERED, (-0.002, -0.0053, 0.0), 90) == 0.0
    assert way(CORNERED, (-0.002, -0.0053, 0.0), -90) > 0.02


def test_without_foam_there_is_no_end() -> None:
    assert way(Opening(), (0.3, 0.0, 0.0), 0) == math.inf
    assert not Opening().touches(square_corners(HALF_M, (0.3, 0.0, 0.0)))[0]
