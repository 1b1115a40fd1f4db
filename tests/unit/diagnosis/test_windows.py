"""A window's weight is that of the parabola that is fitted to its places, and windows lie where the slide ends."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.tracks import run_tracks
from station.diagnosis.observations.windows import FINE_NODES, FRAMES, NODES, WEIGHTS, weight_of, windows_of
from station.physics.contact import Array
from tests.unit.diagnosis.recorded import OPENING_RADIUS_M, session

TIMES = np.linspace(-1.0, 1.0, FRAMES)


def curvature(times: Array, places: Array) -> float:
    """Twice the last coefficient of the parabola through `places` at `times`, both (k,)."""
    return 2.0 * float(np.polyfit(times, places, 2)[0])


@pytest.mark.parametrize("lost", [(), (2,), (1, 6)])
def test_the_fit_is_the_weighted_mean_of_any_acceleration(lost: tuple[int, ...]) -> None:
    times = np.delete(TIMES, lost)
    # a plate that is set in motion: nothing, then a pull that grows
    begin, places, pull = -0.3, np.maximum(times + 0.3, 0.0) ** 3 / 6.0, np.maximum(FINE_NODES + 0.3, 0.0)
    assert begin in np.round(FINE_NODES, 9)
    assert curvature(times, places) == pytest.approx(float(weight_of(times) @ pull), abs=1e-3)


@pytest.mark.parametrize("power", range(4))
def test_three_points_average_what_bends_smoothly(power: int) -> None:
    places = TIMES ** (power + 2) / ((power + 1) * (power + 2))
    assert curvature(TIMES, places) == pytest.approx(float(WEIGHTS @ NODES**power), abs=2e-3)


@pytest.mark.parametrize("later_ms", [6, 25, 60])
def test_an_onset_that_is_read_later_moves_no_window(later_ms: int) -> None:
    """It may lose the first one: the windows that both readings have end at the same frames."""
    setting, tracks = Setting(opening_radius_m=OPENING_RADIUS_M), run_tracks(session())
    read_later = [replace(track, slip_ns=track.slip_ns + later_ms * 1_000_000) for track in tracks]
    ends, later = ({*windows_of(some, setting)["to_ns"].tolist()} for some in (tracks, read_later))
    assert later
    assert later <= ends
