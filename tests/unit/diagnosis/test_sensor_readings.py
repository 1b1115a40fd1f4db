"""An angle sensor that is turned on the plate in an unknown way tells the arm's errors, and not its own turn."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from shared.geometry import Array
from station.diagnosis.observations.moments import Moments, RunFacts
from station.diagnosis.observations.plate import Attitude
from station.diagnosis.observations.sensor_readings import LATENCY_S, Directions, Lateness, Stretches, Tilts
from station.physics.catalogue import catalogue
from station.physics.model import Model, Term

ROUND = tuple(np.radians([0.0, 90.0, 180.0, 270.0]))
POINTS = 3
TILTS_RAD = np.array([0.1, 0.2, 0.3, 0.4])
EXACT_RAD = 1e-9


def plate(directions: tuple[float, ...]) -> tuple[Array, Array]:
    """The tilts and descents (n,) that the arm reports, rad."""
    down = np.repeat(directions, len(TILTS_RAD))
    return np.tile(TILTS_RAD, len(directions)), down


FACTS = RunFacts(
    number=np.ones(1), rest_ns=np.zeros(1, dtype=np.int64), mount_rad=np.zeros(1), mass_kg=np.full(1, 0.02),
    area_m2=np.full(1, 2e-4), temperature_c=np.full(1, np.nan), relative_humidity=np.full(1, np.nan),
    dwell_s=np.ones(1),
)  # fmt: skip
"""The one run in which every reading lies."""


def gravity(tilt_rad: Array, down_rad: Array) -> Array:
    level = np.sin(tilt_rad)
    return np.column_stack([level * np.cos(down_rad), level * np.sin(down_rad), -np.cos(tilt_rad)])


def asked(tilt_rad: Array, down_rad: Array) -> Stretches:
    """POINTS moments of each stretch, in which the plate stands still."""
    count = POINTS * len(tilt_rad)
    none = np.zeros((count, 3))
    still = Attitude(
        gravity=np.repeat(gravity(tilt_rad, down_rad), POINTS, axis=0), rate_rad_s=none, acceleration_rad_s2=none,
        rising=np.ones(count), gone_rad=np.zeros(count), swing_rad=none, step_s=np.zeros(count),
    )  # fmt: skip
    moments = Moments(
        time_ns=np.zeros(count, dtype=np.int64), run=np.zeros(count, dtype=np.int64), facts=FACTS,
        attitude=lambda _: still, delay_s=Model.arm_delay_s,
    )  # fmt: skip
    return Stretches(moments, np.full(len(tilt_rad), POINTS))


def model(effect: str = "", **values: float) -> Model:
    """A model with an error of the arm."""
    if not effect:
        return Model(mu_s=0.4)
    known = catalogue()[effect]
    return Model(mu_s=0.4, terms=(Term(known, {**known.neutral(), **values}),))


def read(true: Model, directions: tuple[float, ...], askew_deg: tuple[float, float, float]) -> Directions:
    """A sensor's noise-free readings on a plate whose arm errs as `true` says."""
    tilt, down = plate(directions)
    felt = asked(tilt, down).moments.loads(true).contact.gravity[::POINTS]
    felt = Rotation.from_rotvec(np.radians(askew_deg)).apply(felt)
    return Directions(
        felt, gravity(tilt, down), stretches=asked(tilt, down), sigma=np.full(len(tilt), 1e-4),
        mount_rad=np.zeros(len(tilt)),
    )  # fmt: skip


ERRORS = [
    model("angle_scale", gain=0.02, offset_rad=0.006),
    model("platform_level", eps_x_rad=0.02, eps_y_rad=-0.03),
]


@pytest.mark.parametrize("askew_deg", [(0.0, 0.0, 0.0), (0.7, -0.4, 2.0), (3.0, 5.0, -10.0)])
@pytest.mark.parametrize("true", [model(), *ERRORS])
def test_the_sensors_turn_is_no_error_of_the_arm(true: Model, askew_deg: tuple[float, float, float]):
    """The rest is the same however the sensor is turned, and it is nothing under the model that is true."""
    straight, turned = read(true, ROUND, (0.0, 0.0, 0.0)), read(true, ROUND, askew_deg)
    for plain, other in ((straight.along, turned.along), (straight.across, turned.across)):
        assert np.abs(other(true)).max() < EXACT_RAD
        np.testing.assert_allclose(other(model()), plain(model()), atol=EXACT_RAD)


@pytest.mark.parametrize("true", ERRORS)
def test_an_error_of_the_arm_is_seen_beside_it(true: Model):
    """A gain and an offset change the tilt; a level error changes what is across the slope by its (1 - cos tilt)."""
    turned = read(true, ROUND, (0.7, -0.4, 2.0))
    seen = max(np.abs(turned.along(model())).max(), np.abs(turned.across(model())).max())
    assert seen > 5e-4


def test_an_offset_is_told_in_opposite_directions_alone():
    """A sensor that sees one direction may as well be turned about the tilt's axis."""
    true = model("angle_scale", offset_rad=0.006)
    there, back = read(true, ROUND[:1], (0.0, 0.0, 0.0)), read(true, (ROUND[0], ROUND[2]), (0.0, 0.0, 0.0))
    assert np.abs(there.along(model())).max() < EXACT_RAD
    assert back.along(model()) == pytest.approx(-0.006, rel=1e-3)


def _tilts(askew: Callable[[Array], Array]) -> Tilts:
    tilt, down = plate(ROUND)
    return Tilts(
        askew(down), stretches=asked(tilt, down), sigma=np.full(len(tilt), 1e-4), mount_rad=np.zeros(len(tilt))
    )


def test_a_sensor_of_the_tilt_alone_may_be_turned_and_have_an_offset():
    """It tells the gain."""
    turned = _tilts(lambda down: 0.01 * np.cos(down) - 0.004 * np.sin(down) + 0.02)
    assert np.abs(turned.along(model())).max() < EXACT_RAD
    assert np.abs(turned.along(model("angle_scale", offset_rad=0.006))).max() < EXACT_RAD
    assert np.abs(turned.along(model("angle_scale", gain=0.02))).max() > 1e-3


def test_a_plate_in_another_mount_turns_the_sensor_otherwise():
    """Two mounts, in each of which the sensor stands otherwise: nothing is left."""
    tilt, down = plate(ROUND)
    mount, straight = np.repeat([0.0, np.pi], len(tilt) // 2), gravity(tilt, down)
    felt = np.where(mount[:, None] == 0.0, straight, Rotation.from_rotvec([0.02, 0.01, 0.0]).apply(straight))
    sigma = np.full(len(tilt), 1e-4)
    found = Directions(felt, straight, stretches=asked(tilt, down), sigma=sigma, mount_rad=mount)
    assert np.abs(found.along(model())).max() < EXACT_RAD
    assert np.abs(found.across(model())).max() < EXACT_RAD


def test_the_rest_of_a_late_sensor_has_the_covariance_of_its_noise():
    """The quadratic form is that of the Gaussian with the lateness in its covariance."""
    rng = np.random.default_rng(20261130)
    rate, sigma, residual = rng.uniform(-1.0, 0.2, 9), rng.uniform(1e-4, 3e-4, 9), 1e-3 * rng.standard_normal(9)
    covariance = np.diag(sigma**2) + LATENCY_S**2 * np.outer(rate, rate)
    white = Lateness(rate, sigma).less(residual) / sigma
    assert white @ white == pytest.approx(residual @ np.linalg.solve(covariance, residual))


def test_a_sensor_that_stands_still_is_not_late():
    residual = np.array([1e-4, -2e-4])
    np.testing.assert_array_equal(Lateness(np.zeros(2), np.full(2, 1e-4)).less(residual), residual)
