"""The speed by which a moving mark is read: that of its frame, not that of half a frame ago."""

import numpy as np
import pytest
from numpy.typing import NDArray

from pi_agent.tracking.motion import Motion

FRAME_S = 1 / 90
SQUARE = 40.0 * np.exp(1j * (np.pi / 4 + np.pi / 2 * np.arange(4)))


def _at(place: complex, yaw_rad: float = 0.0) -> NDArray[np.complex128]:
    return 300.0 + 300.0j + place + SQUARE * np.exp(1j * yaw_rad)


@pytest.mark.parametrize("skipped", [set[int](), {3}, {2, 4}])
def test_steadily_gained_speed_is_that_of_the_last_frame(skipped: set[int]) -> None:
    gain, turn = 15_000.0 + 4_000.0j, 9.0
    motion = Motion()
    for number in sorted(set(range(7)) - skipped):
        time = number * FRAME_S
        motion.update(_at(0.5 * gain * time**2, 0.5 * turn * time**2), time)
    time = 6 * FRAME_S
    assert motion.way.velocity_px_s == pytest.approx(gain * time, rel=1e-9)
    assert motion.way.yaw_rate_rad_s == pytest.approx(turn * time, rel=1e-6)


def test_steadily_gained_speed_is_sure_and_a_sudden_one_is_not() -> None:
    gain, motion = 15_000.0, Motion()
    unsteady = []
    for number in range(8):
        time = max(number - 3, 0) * FRAME_S
        motion.update(_at(0.5 * gain * time**2), number * FRAME_S)
        unsteady.append(motion.way.unsteady_px_s)
    assert max(unsteady[:4]) < 1e-6
    assert unsteady[4] > 0.99 * gain * FRAME_S  # all that it has by then
    assert max(unsteady[6:]) < 1e-6


def test_a_small_first_step_may_have_been_made_at_once_and_fast() -> None:
    motion = Motion()
    for number, place in enumerate([0.0, 0.0, 0.0, 0.2]):
        motion.update(_at(place), number * FRAME_S)
    at_once_px_s = np.sqrt(2.0 * 60_000.0 * 0.2)
    assert motion.way.unsteady_px_s == pytest.approx(at_once_px_s - 1.5 * 0.2 / FRAME_S)


def test_a_mark_that_is_stopped_does_not_turn_back() -> None:
    motion = Motion()
    for number, place in enumerate([0.0, 20.0, 40.0, 43.0, 43.0, 43.0]):
        motion.update(_at(place), number * FRAME_S)
        assert motion.way.velocity_px_s.real >= 0.0
    assert motion.way.velocity_px_s == 0.0


def test_the_next_way_goes_on_as_the_last_ones_did() -> None:
    gain, motion = 15_000.0 - 9_000.0j, Motion()
    for number in range(5):
        motion.update(_at(0.5 * gain * (number * FRAME_S) ** 2), number * FRAME_S)
    time = 5 * FRAME_S
    predicted = motion.predict(time)
    assert predicted is not None
    np.testing.assert_allclose(predicted, _at(0.5 * gain * time**2), atol=1e-6)
    assert motion.expected_way(time).velocity_px_s == pytest.approx(gain * time)
