"""The noise of a recording has a wander where that makes its residuals likelier, and else none."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from station.diagnosis.inference.noise_of import noise_of, with_tails
from station.diagnosis.likelihood.noise import Noise, estimate_noise
from station.diagnosis.likelihood.student import log_density
from station.diagnosis.likelihood.wander import Wander, wanders
from station.diagnosis.likelihood.whitening import Whitening, stack
from station.diagnosis.observations.build import evidence_of
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.setting import Setting
from station.physics.contact import Array
from tests.unit.diagnosis.recorded import OPENING_RADIUS_M, session

LEVEL = 0.08
"""Scatter of the runs' friction."""


@cache
def evidence() -> Evidence:
    return evidence_of(session(), Setting(opening_radius_m=OPENING_RADIUS_M))


def drawn(seed: int, *, tail: float, wander: Wander | None = None) -> dict[str, Array]:
    """Residuals by channel: errors of Student's t, and the runs' levels and their wander along the slides."""
    rng = np.random.default_rng(seed)
    found = {one.name: one.rows.sigma * rng.standard_t(tail, len(one)) for one in evidence().channels}
    along = evidence().channel("along")
    assert along is not None
    assert along.travelled_m is not None
    for run in np.unique(along.rows.run):
        mine, level = np.flatnonzero(along.rows.run == run), rng.normal(0.0, LEVEL)
        found["along"][mine] += level
        if wander is not None:
            place = along.travelled_m[mine]
            shared = wander.shared(place[:, None] - place[None, :])
            found["along"][mine] += rng.multivariate_normal(np.zeros(len(mine)), shared)
    return found


def log_density_of(at: dict[str, Array], noise: Noise) -> float:
    whitening = Whitening(evidence(), noise)
    each = log_density(whitening(stack(evidence(), at)), whitening.tail, whitening.limit)
    return float(each.sum() - whitening.log_scale.sum())


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("tail", [3.0, 200.0])
def test_it_is_as_likely_as_with_a_wander_and_as_without(tail: float, seed: int) -> None:
    """A search for a wander takes the tails of the errors for one; a fit with it was up to 37 nats less likely."""
    at = drawn(seed, tail=tail)
    still = with_tails(evidence(), at, estimate_noise(evidence(), at))
    moving = with_tails(evidence(), at, estimate_noise(evidence(), at, wanders(evidence(), at)))
    best = max(log_density_of(at, still), log_density_of(at, moving))
    assert log_density_of(at, noise_of(evidence(), at)) > best - 0.5


@pytest.mark.parametrize("seed", range(3))
def test_friction_that_wanders_does_so(seed: int) -> None:
    found = noise_of(evidence(), drawn(seed, tail=200.0, wander=Wander(0.05, 8e-3, smooth=True)))
    assert 0.025 < found.wander["along"].sd < 0.1


def test_onset_and_slide_take_their_shared_friction_from_one_noise() -> None:
    at = drawn(1, tail=3.0)
    one, other = (with_tails(evidence(), at, estimate_noise(evidence(), at, wander)) for wander in ({}, wander_of(at)))
    mixed = one.with_channels(other, {"onset", "along"})
    assert mixed.friction == other.friction
    assert mixed.factor["along"] == other.factor["along"]
    assert mixed.factor["rest"] == one.factor["rest"]
    assert one.with_channels(other, {"turn"}).friction == one.friction


def wander_of(at: dict[str, Array]) -> dict[str, Wander]:
    return wanders(evidence(), at)
