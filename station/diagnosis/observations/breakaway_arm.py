"""The point about which a session's plate truly turns, as the blocks' first paths show it.

Blocks that are pushed as the plate is set in motion go at the crest of a push, and lose it again. Each path then seems
to have another law of friction, and all together none.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from station.diagnosis.observations.breakaway import Breakaways, Law
from station.diagnosis.observations.breakaway_law import FEW, GAIN, MANY, NARROW, TRIED
from station.diagnosis.observations.breakaway_search import Effort, Sloped, climbed
from station.physics.contact import Array

PLAIN = Law(drop_spread=3e-3, creep_m=1e-4)
"""The law under which the arm is first sought: friction is nearly the same at rest and while blocks slide."""

SOFTENED = (20.0, 6.0, 1.5)
"""The factors on the noise along the way, see `breakaway_law`."""

HEIGHTS_M = (0.01, 0.02, 0.03, 0.045, 0.06, 0.08, 0.1, 0.13, 0.17, 0.22, 0.3, 0.4)
"""The arms along the plate's normal, up and down, at which the search may begin: they push along the slope."""

UNIT_M, STEP, MOST = 0.01, 0.05, 50.0
"""The arm is sought in centimetres, up to half a metre; its slopes are taken over half a millimetre."""

BRIEF, THOROUGH = Effort(8, 0.05), Effort(20, 0.05)
"""The searches on the way and the last ones."""

FOLLOWED, STILL_M = 6, 5e-4
"""The last search begins anew where it ended at most so often, while that moves the arm by more than this."""

AXES = np.eye(3)


def likeliest_arm(paths: Breakaways, law: Law) -> Array:
    """Returns the arm (3,), m, from the plate's true pivot to the configured one; `law` fits best without an arm.

    It is 0 unless the paths gain by each of its numbers as much as a number of a law has to bring, beside that law or
    without any: what an arm does was put down to the law.
    """
    few, many = paths.some(FEW), paths.some(MANY)
    arm_m = _begun(few)
    for times in SOFTENED:
        arm_m = _climbed(few, PLAIN, arm_m, times)
    gained = {beside: _gain(many, law, arm_m, beside) for beside in (law, PLAIN)}
    beside = max(gained, key=gained.__getitem__)
    return _followed(many, beside, arm_m) if gained[beside] > GAIN * len(AXES) else np.zeros(3)


def _begun(paths: Breakaways) -> Array:
    """Returns the likeliest of the arms at which the search may begin."""
    near = paths.softened(SOFTENED[1])
    arms = [np.array([0.0, 0.0, side * height]) for height in (0.0, *HEIGHTS_M) for side in (1.0, -1.0)]
    return max(arms, key=lambda arm_m: near.loaded(arm_m).log_likelihood(PLAIN))


def _followed(paths: Breakaways, law: Law, arm_m: Array) -> Array:
    """Returns the likeliest arm near another; the moments that are tried follow it until it no longer moves."""
    for _ in range(FOLLOWED):
        before, arm_m = arm_m, _climbed(paths, law, arm_m, 1.0)
        if np.abs(arm_m - before).max() < STILL_M:
            break
    return arm_m


def _gain(paths: Breakaways, law: Law, arm_m: Array, beside: Law) -> float:
    """Returns the gain in log likelihood by an arm beside a law, over another law alone.

    It is no more than its scatter from run to run lets it be worth.

    Paths that no law fits gain by anything, each another amount: with the mean over its standard error as z, that is
    half of z² (Vuong 1989, Econometrica 57, 307).
    """
    of_runs = _near(paths, beside, arm_m).of_runs(beside) - _near(paths, law, np.zeros(3)).of_runs(law)
    whole, scatter = float(of_runs.sum()), float(of_runs.std()) * math.sqrt(len(of_runs))
    return min(whole, 0.5 * whole * abs(whole) / max(scatter, 1e-9) ** 2)


def _near(paths: Breakaways, law: Law, arm_m: Array, times: float = 1.0) -> Breakaways:
    turned = paths.turning_about(arm_m).softened(times)
    return turned if times > NARROW else turned.around(law, TRIED)


def _climbed(paths: Breakaways, law: Law, arm_m: Array, times: float) -> Array:
    """Returns the likeliest arm (3,), m, that is reached from another, with `times` the noise."""
    near, effort = _near(paths, law, arm_m, times), BRIEF if times > 1.0 else THOROUGH

    def value(inner: Array) -> float:
        return near.loaded(UNIT_M * inner).log_likelihood(law)

    def at(inner: Array) -> Sloped:
        """Returns the slopes and the curvature by differences."""
        here = value(inner)
        above, below = (np.array([value(inner + step * axis) for axis in AXES]) for step in (STEP, -STEP))
        curvature = np.diag((2.0 * here - above - below) / STEP**2)
        for i, j in itertools.combinations(range(len(AXES)), 2):
            both = value(inner + STEP * (AXES[i] + AXES[j])) - above[i] - above[j] + here
            curvature[i, j] = curvature[j, i] = -both / STEP**2
        return Sloped(here, 0.5 * (above - below) / STEP, np.abs(curvature), curvature)

    return UNIT_M * climbed(at, arm_m / UNIT_M, np.array([(-MOST, MOST)] * len(AXES)), effort)[0]
