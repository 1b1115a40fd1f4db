"""A block seen from a moving plate feels gravity and the forces of a turning frame."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from station.simulators.mujoco.grip import GRAVITY, PlateMotion

STEP_S, AHEAD_S = 1e-3, 0.5e-3
PLACE = np.array([0.01, 0.03, 0.005])


@dataclass(frozen=True)
class Plate:
    """The poses that `PlateMotion` reads."""

    plate_rotation: NDArray[np.float64]
    plate_place: NDArray[np.float64]


def turned(angle_rad: float) -> NDArray[np.float64]:
    """World_from_plate, (3, 3), of a plate that is turned about x."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def moved(*, rate_rad_s: float = 0.0, speeding_up_m_s2: float = 0.0, start_rad: float = 0.3) -> PlateMotion:
    """A plate that has turned about x and been pushed along the world's y for four steps."""
    motion = PlateMotion(ahead_s=AHEAD_S)
    for step in range(5):
        time = step * STEP_S
        place = np.array([0.0, 0.5 * speeding_up_m_s2 * time**2, 0.5])
        motion.take(Plate(turned(start_rad + rate_rad_s * time).ravel(), place), seconds=STEP_S)  # pyright: ignore[reportArgumentType] (what it reads of them)
    return motion


def test_a_plate_at_rest_pulls_by_gravity_alone() -> None:
    pull = moved().pull(PLACE.tolist(), (0.1, 0.2, 0.0), ago_s=0.5 * STEP_S, step_s=0.2 * STEP_S)
    assert pull == pytest.approx(turned(0.3).T @ (0.0, 0.0, -GRAVITY), abs=1e-9)
    assert moved().needed(PLACE.tolist()) == pytest.approx([-each for each in pull], abs=1e-9)


def test_a_pushed_plate_leaves_its_block_behind() -> None:
    pull = moved(speeding_up_m_s2=2.0).pull(PLACE.tolist(), (0.0, 0.0, 0.0), ago_s=0.5 * STEP_S, step_s=0.2 * STEP_S)
    assert pull == pytest.approx(turned(0.3).T @ (0.0, -2.0, -GRAVITY), abs=1e-6)


@pytest.mark.parametrize("velocity", [(0.0, 0.0, 0.0), (0.1, 0.3, 0.0)])
def test_a_turning_plate_flings_its_block_and_bends_its_way(velocity: tuple[float, float, float]) -> None:
    rate = 2.0
    spin = np.array([rate, 0.0, 0.0])
    middle = turned(0.3 + 3.0 * STEP_S * rate)
    wanted = middle.T @ (0.0, 0.0, -GRAVITY) - np.cross(spin, np.cross(spin, PLACE)) - 2 * np.cross(spin, velocity)
    pull = moved(rate_rad_s=rate).pull(PLACE.tolist(), velocity, ago_s=0.5 * STEP_S, step_s=0.2 * STEP_S)
    assert pull == pytest.approx(wanted, abs=2e-4)


def test_an_acceleration_that_grows_is_felt_when_it_acts() -> None:
    """The mean over a stretch's steps is the true one of its middle, as each step stands for what is around it."""
    motion, growing_m_s3 = PlateMotion(ahead_s=AHEAD_S), 300.0
    for step in range(5):
        place = np.array([0.0, growing_m_s3 * (step * STEP_S) ** 3 / 6, 0.5])
        motion.take(Plate(np.eye(3).ravel(), place), seconds=STEP_S)  # pyright: ignore[reportArgumentType] (what it reads of them)
    count = 5
    pulls = [
        motion.pull(PLACE.tolist(), (0.0, 0.0, 0.0), ago_s=left * STEP_S / count, step_s=STEP_S / count)[1]
        for left in range(count, 0, -1)
    ]
    # The last stretch is around the last but one pose; its first step stands for a half that is before it.
    middle_s = 3.0 * STEP_S - 0.5 * STEP_S / count
    assert -np.mean(pulls) == pytest.approx(growing_m_s3 * middle_s, rel=1e-6)
