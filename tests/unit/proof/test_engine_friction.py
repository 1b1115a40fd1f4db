"""An engine with good settings has Coulomb's friction: the proof's worlds of it are plain only as far as it has.

A block of the patch world lies on a plate whose tilt rises through the angle of friction, without arm, camera or noise.
While it slides, the friction that its acceleration shows is compared with the coefficient that the engine was given.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.proof.engine_bench import Engine
from tests.proof.engine_family import EngineFamily
from tests.proof.families.bullet import Bullet
from tests.proof.families.mujoco import Mujoco
from tests.proof.patch_world.world import Contact

G = 9.81
CONTACT = Contact()
LEVEL_S, BEGIN_RAD, LASTS_S = 0.5, math.atan(CONTACT.mu) - math.radians(1.5), 1.6
FROM_M_S = 0.01
"""Friction is read from this speed on: the first millimetres tell the onset, which is not compared here."""
CASES = [(0.3, 0.5, 2.0), (0.0, 0.5, 2.0), (1.1, 2.0, 3.0), (0.7, 4.0, 2.0)]
"""Yaw (rad), direction of the slope (rad) and rate of the tilt (deg/s)."""


def friction(engine: Engine, *, yaw: float, slope: float, rate_deg_s: float) -> np.ndarray:
    """The friction (4,) of the four quarters of a slide, less the coefficient's and relative to it."""
    down = np.array([math.cos(slope), math.sin(slope)])

    def step(tilt: float) -> float:
        engine.step(np.array([*(G * math.sin(tilt) * down), -G * math.cos(tilt)]), np.zeros(2), 0.0)
        return float(np.dot(engine.read()[3:5], down))

    engine.put(0.0, 0.0, yaw, mu=CONTACT.mu)
    for part in np.linspace(0.0, 1.0, round(LEVEL_S / engine.step_s)):
        step(part * BEGIN_RAD)
    tilts = BEGIN_RAD + math.radians(rate_deg_s) * engine.step_s * (np.arange(round(LASTS_S / engine.step_s)) + 0.5)
    speed = np.array([step(tilt) for tilt in tilts])
    sliding = np.arange(len(speed)) >= int(np.argmax(speed > FROM_M_S))
    gained, steep = np.gradient(speed[sliding], engine.step_s), tilts[sliding]
    shown = (G * np.sin(steep) - gained) / (G * np.cos(steep)) / CONTACT.mu - 1.0
    return np.array([part.mean() for part in np.array_split(shown, 4)])


def built(family: type[EngineFamily]) -> Engine:
    made = family()
    if reason := made.why_not():
        pytest.skip(reason)
    return made.engine(CONTACT)


@pytest.mark.parametrize("family", [Mujoco, Bullet])
@pytest.mark.parametrize(("yaw", "slope", "rate_deg_s"), CASES)
def test_a_slide_has_the_friction_that_its_engine_was_given(
    family: type[EngineFamily], yaw: float, slope: float, rate_deg_s: float
) -> None:
    found = friction(built(family), yaw=yaw, slope=slope, rate_deg_s=rate_deg_s)
    assert np.abs(found).max() < 1e-3, "a session of sixty runs knows it to 0.3 %"


@pytest.mark.parametrize("family", [Mujoco, Bullet])
@pytest.mark.parametrize("less_deg", [2.0, 15.0])
def test_a_slide_is_braked_and_ends_by_the_friction_that_its_engine_was_given(
    family: type[EngineFamily], less_deg: float
) -> None:
    """The block slides on a plate that is too steep for it, and then on one that is too level by `less_deg`."""
    engine = built(family)

    def speeds(slope: float, count: int) -> list[float]:
        found: list[float] = []
        for _ in range(count):
            engine.step(G * np.array([math.sin(slope), 0.0, -math.cos(slope)]), np.zeros(2), 0.0)
            found.append(engine.read()[3])
        return found

    engine.put(0.0, 0.0, 0.3, mu=CONTACT.mu)
    (*_, fast) = speeds(math.radians(25.0), 200)
    level = math.atan(CONTACT.mu) - math.radians(less_deg)
    braking = G * (CONTACT.mu * math.cos(level) - math.sin(level))
    lasts = round(fast / braking / engine.step_s)
    braked = np.array(speeds(level, lasts + 50))
    expected = fast - braking * engine.step_s * np.arange(1, lasts + 1)
    assert braked[:lasts] == pytest.approx(expected, abs=0.01 * fast)
    assert np.abs(braked[lasts + 5 :]).max() < 1e-4, "it rests"
