"""The slopes of the breakaways' likelihood, which the search for a session's law climbs by, are its derivatives."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from station.diagnosis.observations.breakaway import (
    ALONG,
    EXPONENTIAL,
    GAUSSIAN,
    LOGARITHM,
    LORENTZIAN,
    Breakaways,
    Law,
)
from tests.unit.diagnosis.test_slips import looked_at, one_run

NUMBERS = (*ALONG, "drop_spread", "creep_m")
BY_LOG = ("fall_speed_m_s", "drop_spread", "creep_m")
STEP = 1e-4

SLIDES = {
    EXPONENTIAL: Law(drop=0.02, fall=0.03, drop_spread=0.01, creep_m=1e-4, drag_per_s=2.0),
    LORENTZIAN: Law(fall=0.05, drop_spread=0.003, creep_m=1e-5, drag_per_s=3.0, shape=LORENTZIAN),
    LOGARITHM: Law(drop=0.01, fall=-0.02, fall_speed_m_s=0.005, drop_spread=0.01, creep_m=1e-4, shape=LOGARITHM),
    GAUSSIAN: Law(drop=0.01, fall=0.05, drop_spread=0.01, creep_m=1e-4, drag_per_s=2.0, shape=GAUSSIAN),
}


def _share(law: Law, speed: float) -> float:
    """Returns the share of the static friction that is left at a speed."""
    ratio = speed / law.fall_speed_m_s
    fallen = {
        EXPONENTIAL: -math.expm1(-ratio),
        LORENTZIAN: 1 - 1 / (1 + ratio**2),
        LOGARITHM: math.log1p(ratio),
        GAUSSIAN: 1 - math.exp(-(ratio**2)),
    }
    return 1.0 - law.drop - law.fall * fallen[law.shape]


def _moved(law: Law, name: str, by: float) -> Law:
    value = getattr(law, name)
    return replace(law, **{name: value * math.exp(by) if name in BY_LOG else value + by})


@pytest.mark.parametrize("planted", SLIDES.values(), ids=["exponential", "lorentzian", "logarithm", "gaussian"])
def test_the_slopes_are_central_differences(planted: Law) -> None:
    """The law lies beside the likeliest one, where no slope vanishes."""
    rng = np.random.default_rng(5)
    slides = [one_run(lambda speed: _share(planted, speed), planted.drag_per_s, rng)[0] for _ in range(4)]
    law = replace(planted, drop=planted.drop + 0.002, drag_per_s=planted.drag_per_s + 0.1)
    paths = Breakaways.of([looked_at(run) for run in slides]).around(law, 13)
    found = paths.sloped(law, law.along(ALONG))

    def slope(name: str) -> float:
        step = STEP if name in BY_LOG else 1e-2 * STEP
        higher, lower = (paths.log_likelihood(_moved(law, name, by)) for by in (step, -step))
        return (higher - lower) / (2 * step)

    assert found.value == pytest.approx(paths.log_likelihood(law), rel=1e-12)
    assert found.slope == pytest.approx(np.array([slope(name) for name in NUMBERS]), rel=1e-3, abs=1e-3)
    # The information is a covariance: it is symmetric, and no direction has a negative one.
    assert found.complete == pytest.approx(found.complete.T)
    assert np.linalg.eigvalsh(found.complete).min() > -1e-6 * np.trace(found.complete)


def test_fewer_numbers_have_the_same_slopes() -> None:
    """The slopes by some of the numbers are those among all of them."""
    law = SLIDES[EXPONENTIAL]
    rng = np.random.default_rng(6)
    slides = [one_run(lambda speed: _share(law, speed), law.drag_per_s, rng)[0] for _ in range(2)]
    paths = Breakaways.of([looked_at(run) for run in slides]).around(law, 13)
    every, some = paths.sloped(law, law.along(ALONG)), paths.sloped(law, law.along(("fall", "drag_per_s")))
    places = [NUMBERS.index(name) for name in ("fall", "drag_per_s", "drop_spread", "creep_m")]
    assert some.slope == pytest.approx(every.slope[places], rel=1e-12)
    assert some.observed == pytest.approx(every.observed[np.ix_(places, places)], rel=1e-9)
