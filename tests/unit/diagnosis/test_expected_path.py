"""The expected path of a window's nodes has none of the noise of that window's own acceleration."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from station.diagnosis.observations.build import Recorded, evidence_of
from station.diagnosis.observations.expected_path import expected_path
from station.diagnosis.observations.moments import Load
from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.slides import Along
from station.diagnosis.observations.windows import NODES, Windows
from station.physics.contact import Array
from tests.unit.diagnosis.recorded import OPENING_RADIUS_M, session

NOISE_M = 1e-4
"""Standard deviation of the bend that noise gives to a window's path; it is a hundred times the simulated corners'."""


@cache
def recorded() -> tuple[Windows, Load]:
    """The windows of a session without any effect, and their loads."""
    setting = Setting(opening_radius_m=OPENING_RADIUS_M)
    along = evidence_of(session(), setting).channel("along")
    assert isinstance(along, Along)
    return Recorded(session(), setting).free_windows, along.motion.moments.plain


def bent(windows: Windows) -> tuple[Windows, Array]:
    """The windows with noise in their acceleration, and the bends (n, 2), m, that it gave to their paths."""
    bend = np.random.default_rng(5).normal(0.0, NOISE_M, (len(windows), 2))
    half_s = 1e-9 * (windows["node_ns"][:, 2] - windows["node_ns"][:, 1]) / NODES[2]
    found = windows.copy()
    found["node_pose"][..., :2] += bend[:, None, :] * (NODES**2)[:, None]
    found["node_velocity"] += 2.0 * bend[:, None, :] * NODES[:, None] / half_s[:, None, None]
    found["acceleration_m_s2"] += 2.0 * bend / half_s[:, None] ** 2
    return found, bend


def second(place: Array) -> Array:
    """The second differences (n, 2), m, of places (3 n, 2)."""
    first, middle, last = place.reshape(-1, 3, 2).transpose(1, 0, 2)
    return np.asarray(first - 2.0 * middle + last)


def test_a_plain_slide_goes_as_expected() -> None:
    """Up to what a run's own friction, which scatters by 5 % of 3.4 m/s², changes within 40 ms."""
    windows, plain = recorded()
    place, velocity, _ = expected_path(windows, plain)
    assert place == pytest.approx(windows["node_pose"][..., :2].reshape(-1, 2), abs=3e-4)
    assert velocity == pytest.approx(windows["node_velocity"].reshape(-1, 2), abs=1.5e-2)


def test_the_noise_of_a_windows_acceleration_does_not_bend_its_path() -> None:
    windows, plain = recorded()
    noisy, bend = bent(windows)
    change = second(expected_path(noisy, plain)[0]) - second(expected_path(windows, plain)[0])
    assert np.sqrt(np.mean(change**2)) < 0.2 * NOISE_M
    assert abs(np.corrcoef(change.ravel(), bend.ravel())[0, 1]) < 0.3
    assert second(noisy["node_pose"][..., :2].reshape(-1, 2)).std() > NOISE_M  # its own path is bent
