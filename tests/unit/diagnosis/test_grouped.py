"""Rows in groups and continuous records: their noise, their windows, and what settles."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import multivariate_normal

from shared.messages import Sample
from station.diagnosis import thresholds
from station.diagnosis.diagnose import examined
from station.diagnosis.inference.fit import fit
from station.diagnosis.inference.level import levelled
from station.diagnosis.likelihood.grouped import ANY, grouped_noise
from station.diagnosis.likelihood.noise import Noise
from station.diagnosis.likelihood.student import log_density
from station.diagnosis.likelihood.wander import Wander
from station.diagnosis.likelihood.whitening import Whitening
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.table import table_evidence
from station.diagnosis.search.candidates import single_candidates
from station.physics.catalogue import catalogue
from station.physics.model import Model
from station.signals.measured import Measured

STEP_M, SPEEDS_M_S = 1e-5, (2e-7, 2e-6)
SPEED_CHANGES = 100
CHI2_95 = 3.84
"""Chance gives a number a larger gain once in twenty times."""


def evidence(columns: dict[str, NDArray[Any]], group: tuple[str, ...] = ()) -> Evidence:
    count = len(columns["friction_coefficient"])
    return table_evidence(Measured(samples=(Sample(),) * count, more=columns, group=group), Setting())


def record(*, settles_m: float = 0.0, wander: float = 0.0, rows: int = 400) -> Evidence:
    """A record whose speed grows tenfold after a quarter of its slip, by 10 % of friction over `settles_m`."""
    rng = np.random.default_rng(3)
    place = STEP_M * np.arange(rows)
    fast = np.arange(rows) >= SPEED_CHANGES
    since = np.maximum(place - place[SPEED_CHANGES], 0.0)
    share = 1.0 - np.exp(-since / settles_m) if settles_m else 1.0 * fast
    course = np.zeros(rows)
    for one in range(1, rows):
        course[one] = 0.9 * course[one - 1] + rng.normal(0.0, wander * np.sqrt(1 - 0.81))
    friction = 0.45 * (1.0 + 0.1 * share * fast) * np.exp(course + rng.normal(0.0, 1e-4, rows))
    time_s = np.cumsum(STEP_M / np.where(fast, SPEEDS_M_S[1], SPEEDS_M_S[0]))
    return evidence({"friction_coefficient": friction, "displacement_m": place, "time_s": time_s})


def test_the_sizes_of_groups_and_rows_are_found() -> None:
    rng = np.random.default_rng(1)
    group = np.repeat(np.arange(40), 10)
    friction = 0.4 * np.exp(rng.normal(0.0, 0.1, 40)[group] + rng.normal(0.0, 0.02, 400))
    seen = evidence({"friction_coefficient": friction}, tuple(map(str, group)))
    noise = grouped_noise(seen, {"onset": seen.channels[0].residual(Model(mu_s=0.4))})
    assert noise.group["onset"] == pytest.approx(0.1, rel=0.25)
    of_rows = np.hypot(noise.own["onset"], noise.factor["onset"] * seen.channels[0].rows.sigma[0])
    assert of_rows == pytest.approx(0.02, rel=0.15)


def test_a_groups_rows_are_whitened_as_the_gaussian_that_they_are() -> None:
    rng = np.random.default_rng(2)
    friction = 0.4 * np.exp(rng.normal(0.0, 0.1, 6))
    columns = {"friction_coefficient": friction, "friction_coefficient_sd": 0.01 * friction}
    seen = evidence(columns, ("a", "a", "b", "a", "b", "b"))
    residual = seen.channels[0].residual(Model(mu_s=0.4))
    noise = Noise(
        friction=0.0,
        own={"onset": 0.03},
        factor={"onset": 2.0},
        tail={"onset": thresholds.GAUSSIAN},
        group={"onset": 0.1},
    )
    whitening = Whitening(seen, noise)
    density = log_density(whitening(residual), whitening.tail, whitening.limit).sum() - whitening.log_scale.sum()
    covariance = 0.1**2 * (seen.block[:, None] == seen.block[None, :]) + (0.03**2 + 0.02**2) * np.eye(6)
    assert density == pytest.approx(multivariate_normal(np.zeros(6), covariance).logpdf(residual), rel=1e-9)


def test_a_records_wander_is_found_in_its_windows() -> None:
    seen = record(wander=0.01, rows=2000)
    along = seen.channel("along")
    assert along is not None
    noise = grouped_noise(seen, {one.name: one.residual(Model(mu_s=0.48)) for one in seen.channels})
    assert seen.runs == 200
    assert isinstance(noise.wander["along"], Wander)
    assert noise.group["settling"] == ANY if seen.channel("settling") else True


def test_a_record_is_averaged_in_windows_of_equal_slip() -> None:
    seen = record(rows=2000)
    (along,) = seen.channels
    assert along.travelled_m is not None
    assert seen.run_number.tolist() == list(range(1, 201)), "a window is no row of the table"
    assert np.diff(along.travelled_m) == pytest.approx(np.full(199, 10 * STEP_M), rel=0.15)
    assert any("2000 rows of a continuous record were averaged in 200 windows" in note for note in seen.notes)
    assert along.contact is not None
    assert np.unique(np.round(along.contact.speed_m_s / SPEEDS_M_S[0])).tolist() == [1, 10]


def test_what_settles_after_a_change_of_speed_is_judged_apart() -> None:
    seen = record(settles_m=20 * STEP_M)
    settling = seen.channel("settling")
    assert settling is not None
    assert 20 < 2 * len(settling) < 200, "some twice to ten times the length over which it settles"
    assert not settling.shares_friction
    along = seen.channel("along")
    assert along is not None
    left = along.residual(Model(mu_s=0.45))
    assert np.ptp(left[left > 0.05]) < 0.02, "what is left has settled"


def test_a_steady_record_has_nothing_that_settles() -> None:
    place = STEP_M * np.arange(300)
    rng = np.random.default_rng(5)
    friction = 0.45 * np.exp(rng.normal(0.0, 1e-3, 300))
    seen = evidence({"friction_coefficient": friction, "displacement_m": place, "time_s": place / 1e-6})
    assert [channel.name for channel in seen.channels] == ["along"]


def test_a_few_windows_that_settle_are_as_sure_as_the_contact_is() -> None:
    """With their means' own errors two of them once outweighed a whole record, and wear was claimed of it."""
    seen = record(settles_m=2.0 * STEP_M, wander=0.01)
    settling = seen.channel("settling")
    assert settling is not None
    assert len(settling) < thresholds.LEAST_KNOWN
    noise = grouped_noise(seen, {one.name: one.residual(Model(mu_s=0.48)) for one in seen.channels})
    assert noise.wander["settling"] == noise.wander["along"]
    assert noise.factor["settling"] == noise.factor["along"]


def dealt(rng: np.random.Generator, *, like: bool) -> Evidence:
    """Twenty stretches of two speeds, each with a level of friction of its own; `like` the speed's, or any."""
    fast = np.arange(20) % 2 == 1
    own = np.log(1.1) * fast if like else rng.permutation(np.log(1.1) * fast)
    fast, own = np.repeat(fast, 20), np.repeat(own, 20)
    place = STEP_M * np.arange(400)
    friction = 0.45 * np.exp(own + rng.normal(0.0, 1e-3, 400))
    time_s = np.cumsum(STEP_M / np.where(fast, SPEEDS_M_S[1], SPEEDS_M_S[0]))
    return evidence({"friction_coefficient": friction, "displacement_m": place, "time_s": time_s})


def promised(seen: Evidence) -> float:
    """Twice the gain of a law of the speed by its scores, as far as the stretches agree on it."""
    plain = fit(seen, levelled(seen, Model(mu_s=0.4)), ())
    (best,) = single_candidates(seen, plain, [catalogue()["rate_strengthening"]])
    return best.twice_gain


def test_windows_after_one_change_of_speed_are_one_piece_of_evidence() -> None:
    """Levels that jump wherever a speed is set, at random, are no law of it; where they agree it is as sure as ever."""
    rng = np.random.default_rng(6)
    by_chance = [promised(dealt(rng, like=False)) for _ in range(12)]
    assert np.mean(np.array(by_chance) > CHI2_95) <= 0.25
    assert promised(dealt(rng, like=True)) > 5.0 * CHI2_95
    assert dealt(rng, like=True).stretch is not None
    assert record().stretch is None, "two stretches do not say how such levels scatter"


@pytest.mark.parametrize("seed", [733100, 733107])
def test_intervals_hold_unseen_rows_whether_or_not_rows_have_groups(seed: int) -> None:
    """The reading's part of the scatter cannot be told from the row's own, and both count."""
    rng = np.random.default_rng(seed)
    angles_rad = np.arctan(0.31 * np.exp(0.06 * rng.normal(size=60))).tolist()
    samples = tuple(Sample(onset_angle_rad=angle_rad) for angle_rad in angles_rad)
    for names in ((), tuple(f"s{number % 20}" for number in range(60))):
        measured = Measured(samples=samples, more={}, group=names)
        held = examined(measured, catalogue()).diagnosis.fit.after
        assert held.coverage90 == pytest.approx(0.9, abs=0.12)
