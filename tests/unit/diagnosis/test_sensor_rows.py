"""The readings of another angle sensor by which a stretch of a run is compared, and their noise."""

from dataclasses import replace

import numpy as np
import pytest

from station.diagnosis.observations.build import evidence_of
from station.diagnosis.observations.sensor_rows import (
    POINTS,
    Stretch,
    _noise,  # pyright: ignore[reportPrivateUsage]
    _spread,  # pyright: ignore[reportPrivateUsage]
)
from station.diagnosis.observations.setting import Setting
from station.signals.tracks import AngleTrack
from tests.unit.diagnosis.recorded import session

STEP_NS = 20_000_000


def test_a_sensor_beside_an_arm_that_was_not_heard_tells_nothing():
    """It ended in a traceback: no attitude was recorded with which its readings could be compared."""
    heard = session()
    time_ns = heard.attitude.time_ns
    readings = AngleTrack(
        time_ns=time_ns,
        angle_rad=np.full(len(time_ns), 0.3),
        gravity=np.zeros((len(time_ns), 3)),
        sigma_rad=np.full(len(time_ns), 1e-3),
    )
    silent = replace(heard, attitude=heard.attitude.select(slice(0, 0)), angles={"imu": readings})
    assert not evidence_of(silent, Setting()).channels


@pytest.mark.parametrize("count", [POINTS, 17, 25, 40, 113])
def test_the_moments_of_a_stretch_have_the_mean_of_all_readings(count: int):
    """A step of 2° in the middle of a stretch: a late clock is told by such means to a thousandth of a degree."""
    time_ns = 7 * STEP_NS + STEP_NS * np.arange(count)

    def angle_deg(at_ns: np.ndarray) -> np.ndarray:
        place = ((at_ns - time_ns[0]) / STEP_NS + 0.5) / count
        return 2.0 * np.clip((place - 0.3) / 0.4, 0.0, 1.0)

    assert angle_deg(_spread(time_ns)).mean() == pytest.approx(angle_deg(time_ns).mean(), abs=0.004)


def test_a_stretch_of_few_readings_has_each_of_them():
    time_ns = np.array([3, 40, 75]) * STEP_NS
    assert (_spread(time_ns) == time_ns).all()


@pytest.mark.parametrize("wander_rad", [0.0, 0.02])
def test_the_noise_is_that_of_readings_and_not_of_what_wanders_in_a_stretch(wander_rad: float):
    """The noise of 30 readings of 1 mrad, and a difference that goes to and fro by 20 mrad, as a late clock has it."""
    rng = np.random.default_rng(20261129)
    apart = 1e-3 * rng.standard_normal((1200, 2)) + wander_rad * np.sin(np.arange(1200) / 10.0)[:, None]
    stretches = [Stretch(0, np.arange(begin, begin + 30)) for begin in range(0, 1200, 30)]
    assert _noise(apart, stretches) == pytest.approx(1e-3 / np.sqrt(30), rel=0.1)
