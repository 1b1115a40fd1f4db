"""The readings of an attitude that count."""

import numpy as np
import pytest

from station.signals.tracks import AttitudeTrack


def attitude(tilt_rad: list[float], rate_rad_s: list[float], *, step_ns: int = 10_000_000) -> AttitudeTrack:
    tilt, zero = np.array(tilt_rad), np.zeros(len(tilt_rad))
    return AttitudeTrack(
        time_ns=step_ns * np.arange(len(tilt), dtype=np.int64),
        quaternion=np.column_stack([np.cos(tilt / 2), zero, np.sin(tilt / 2), zero]),
        rate_rad_s=np.column_stack([zero, np.array(rate_rad_s), zero]),
        pivot_m=np.zeros((len(tilt), 3)),
    )


def test_a_driver_that_says_an_old_attitude_again_has_said_it_once():
    """It publishes twice as fast as its arm answers, and the plate turns."""
    said = attitude([0.1, 0.1, 0.12, 0.12, 0.14], [0.5, 0.5, 0.6, 0.6, 0.6])
    assert said.known().time_ns.tolist() == [0, 20_000_000, 40_000_000]


@pytest.mark.parametrize("rate_rad_s", [[0.0, 0.0, 0.0], [0.01, -0.02, 0.01]], ids=["without rates", "with noise"])
def test_a_plate_that_rests_is_read_as_often_as_it_is_said(rate_rad_s: list[float]):
    """Encoders say the same angle again and again."""
    said = attitude([0.1, 0.1, 0.1], rate_rad_s)
    assert said.known() is said


def test_a_lost_attitude_does_not_count():
    said = attitude([0.1, float("nan"), 0.2], [0.5, 0.5, 0.6])
    assert len(said.known()) == 2


def test_a_reading_that_is_not_later_does_not_count():
    assert len(attitude([0.1, 0.11, 0.12], [0.5, 0.5, 0.6], step_ns=0).known()) == 1
