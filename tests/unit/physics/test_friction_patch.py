"""The series of a patch: what its second order is to the first, for what plates have."""

from collections.abc import Callable, Mapping

import numpy as np
import pytest

from station.physics.catalogue import catalogue
from station.physics.contact import Array
from station.physics.effects.friction_patch import FINER, FINER_SD, FIRST
from tests.contracts.effect_states import contacts

PLACES, REACH_M = 250, 0.022
NOISE = 0.003
"""The relative error of the friction that a window of a slide shows."""
LENGTHS_M = (0.006, 0.009, 0.013, 0.02, 0.03)
RATIOS = (0.1, FINER_SD, 2.0)
PLATES = 8
Plate = Callable[[Array, Array, np.random.Generator], Array]


def field(x: Array, y: Array, rng: np.random.Generator) -> Array:
    """Returns a smooth random field (n,) of 8 per cent with a correlation length from 10 to 30 mm."""
    waves = rng.normal(0.0, 1.0 / rng.uniform(0.010, 0.030), (2, 40))
    phases = np.outer(x, waves[0]) + np.outer(y, waves[1]) + rng.uniform(0.0, 2.0 * np.pi, 40)
    return 0.08 * np.sqrt(2.0 / 40) * np.cos(phases).sum(axis=1)


def spots(x: Array, y: Array, rng: np.random.Generator) -> Array:
    """Returns one to four round spots (n,) of 15 per cent."""
    total = np.zeros_like(x)
    for _ in range(rng.integers(1, 5)):
        at, radius = rng.uniform(-0.02, 0.02, 2), rng.uniform(0.006, 0.014)
        total += 0.15 * np.exp(-0.5 * ((x - at[0]) ** 2 + (y - at[1]) ** 2) / radius**2)
    return total


@pytest.mark.parametrize("plate", [field, spots])
def test_the_second_order_is_as_large_as_its_prior_says(plate: Plate) -> None:
    rng = np.random.default_rng(0)
    found = np.array([_log_likelihoods(plate, rng) for _ in range(PLATES)])
    less, same, more = found.mean(axis=0) - found.mean(axis=0).max()
    print(f"{plate.__name__}: ln L a plate with 0.1 {less:.0f}, {FINER_SD} {same:.0f}, 2 {more:.0f}")
    assert same == 0.0
    assert max(less, more) < -5.0


def _log_likelihoods(plate: Plate, rng: np.random.Generator) -> list[float]:
    """Returns a plate's log likelihood with each ratio, the length being the likeliest."""
    away, angle = REACH_M * np.sqrt(rng.random(PLACES)), 2.0 * np.pi * rng.random(PLACES)
    x, y = away * np.cos(angle), away * np.sin(angle)
    friction = plate(x, y, rng)
    return [max(_marginal(friction, x, y, length, ratio) for length in LENGTHS_M) for ratio in RATIOS]


def _marginal(friction: Array, x: Array, y: Array, length_m: float, ratio: float) -> float:
    """Returns ln L of the friction (n,) with a second order of this ratio to the rms of the first, found by rounds."""
    coarse, fine = _columns(x, y, length_m, FIRST), _columns(x, y, length_m, FINER)
    about, rms, covariance = 0.09 * (1.0 + coarse @ coarse.T), 0.05, np.eye(len(x))
    for _ in range(4):
        covariance = NOISE**2 * np.eye(len(x)) + about + (ratio * rms) ** 2 * fine @ fine.T
        rms = float(np.sqrt(np.mean((0.09 * coarse.T @ np.linalg.solve(covariance, friction)) ** 2)))
    return -0.5 * float(friction @ np.linalg.solve(covariance, friction) + np.linalg.slogdet(covariance)[1])


def _columns(x: Array, y: Array, length_m: float, names: Mapping[str, object]) -> Array:
    """Returns ln m (n, k) of each term at a size of 1, that of the first order beside it being one over sqrt(8)."""
    effect = catalogue()["friction_patch"]
    contact = contacts(len(x), x_m=x, y_m=y, mount_rad=0.0)
    plain = effect.neutral() | {"length_m": length_m, "turning": 0.0}
    tiny = 1e-6
    if names is FIRST:
        changed = [plain | {name: tiny} for name in names]
        return np.array([np.log(effect.friction(contact, values)) / tiny for values in changed]).T
    beside = plain | {"slope_x": tiny * np.sqrt(len(FIRST))}  # an rms of tiny
    without = np.log(effect.friction(contact, beside))
    return np.array([(np.log(effect.friction(contact, beside | {n: 1.0})) - without) / tiny for n in names]).T
