"""The block's equation of motion against one in the world's frame, where there are no fictitious forces."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from station.diagnosis.observations.driving import driving
from station.diagnosis.observations.plate import Attitude
from station.physics.contact import GRAVITY_M_S2, Array
from station.physics.reversals import SWINGS

AXIS = np.array([0.3, -0.8, 0.1])


def turn(time_s: float) -> Rotation:
    """The plate's attitude in the world, turning ever faster."""
    return Rotation.from_rotvec(AXIS * (0.4 * time_s + 0.9 * time_s**2))


def pivot(time_s: float) -> Array:
    """A pivot that swings."""
    return 1e-3 * np.array([np.sin(20 * time_s), np.cos(15 * time_s), time_s**2])


def relative(time_s: float) -> Array:
    """Returns the place at which the plate sees a body that falls freely in the world."""
    fallen = np.array([0.02, -0.01, 0.0]) + np.array([0.3, 0.2, 0.0]) * time_s
    fallen[2] -= 0.5 * GRAVITY_M_S2 * time_s**2
    return turn(time_s).inv().apply(fallen - pivot(time_s))


def difference(of: object, order: int, step_s: float = 1e-4) -> Array:
    """First or second derivative at 0 by central differences."""
    before, now, after = (np.asarray(of(time)) for time in (-step_s, 0.0, step_s))  # type: ignore[operator]
    return (after - before) / (2 * step_s) if order == 1 else (after - 2 * now + before) / step_s**2


def test_a_body_that_nothing_holds_falls_as_the_world_says() -> None:
    here, velocity = relative(0.0), difference(relative, 1)
    here[2] = 0.0
    plate = Attitude(
        gravity=np.array([[0.0, 0.0, -1.0]]),
        rate_rad_s=0.4 * AXIS[None],
        acceleration_rad_s2=1.8 * AXIS[None],
        rising=np.ones(1),
        gone_rad=np.full(1, np.inf),
        swing_rad=np.full((1, SWINGS), np.inf),
        step_s=np.zeros(1),
        pivot_m_s2=difference(pivot, 2)[None],
    )
    out_of_plane = np.array([0.0, 0.0, velocity[2]])
    off_plane = np.array([0.0, 0.0, relative(0.0)[2]])
    found = driving(plate, here[None, :2], velocity[None, :2])[0]
    # A block stays in the plate; this body also has a place and a velocity across it, whose parts are added here.
    rate, speeding = 0.4 * AXIS, 1.8 * AXIS
    found -= (
        np.cross(speeding, off_plane) + np.cross(rate, np.cross(rate, off_plane)) + 2 * np.cross(rate, out_of_plane)
    )
    assert np.allclose(found, difference(relative, 2), atol=1e-5)
