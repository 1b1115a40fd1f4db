"""The evidence of the mark's picture: its shape while the block turns."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from station.diagnosis.inference.fit import fit
from station.diagnosis.observations.build import evidence_of
from station.diagnosis.observations.channel import Rows, rows_of
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.shape import Shape, common, gradient_per_m, strain_of
from station.diagnosis.observations.stretches import STRETCH, mean_shape, mean_slopes, stretch
from station.diagnosis.observations.tracks import RunTrack
from station.physics.catalogue import catalogue
from station.physics.contact import Array, View
from station.physics.model import Model, Term
from station.simulators.simulator import simulator
from tests.unit.diagnosis.recorded import OPENING_RADIUS_M, golden, joined

SESSIONS = 4
SQUARE_M = 0.005 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def evidence_with(model: Model, *, seed: int) -> Evidence:
    """Returns what sessions of three runs show in a world of that model."""
    recorded, rig = golden()
    rig = replace(rig, plate=replace(rig.plate, opening_m=2 * OPENING_RADIUS_M))
    rng = np.random.default_rng(seed)
    signals = joined([simulator("planar").repeat(recorded, model, rig=rig, rng=rng) for _ in range(SESSIONS)])
    setting = Setting(
        opening_radius_m=OPENING_RADIUS_M, block_side_m=rig.block.size_m[0], block_mass_kg=rig.block.mass_kg
    )
    return evidence_of(signals, setting)


def test_the_mean_of_a_square_that_turns_is_that_square() -> None:
    turned = np.linspace(-0.6, 0.6, 25)
    at = np.exp(1j * turned)[:, None] * (SQUARE_M @ [1.0, 1j]) + (0.01 + 0.02j)
    seen = np.stack([at.real, at.imag], axis=-1).astype(np.float64)
    np.testing.assert_allclose(mean_shape(seen, turned), SQUARE_M, atol=1e-12)
    shrunk = mean_shape(seen, np.zeros_like(turned))
    assert np.abs(shrunk).max() < 0.97 * SQUARE_M.max(), "turned by 70° the plain mean is several per cent smaller"


def test_the_velocity_of_a_stretch_is_the_mean_over_its_frames() -> None:
    """The plate turns back at 40 °/s under a block that slides: a straight line's slope is off by a tenth per cent."""
    seconds = np.linspace(0.05, 0.15, 10)
    jerk = np.array([-7.0, 2.0, 300.0])
    path = 0.1 * seconds[:, None] + jerk * seconds[:, None] ** 3 / 6.0
    mean = 0.1 + jerk * np.square(seconds).mean() / 2.0
    slopes, bends = mean_slopes(seconds, path)
    np.testing.assert_allclose(slopes, mean, rtol=1e-9)
    np.testing.assert_allclose(bends, jerk * seconds.mean(), rtol=1e-9)
    straight = np.polyfit(seconds, path, 1)[0]
    assert np.abs(straight / mean - 1.0).min() > 1e-3
    np.testing.assert_allclose(mean_slopes(seconds[:3], path[:3])[0], (path[2] - path[0]) / (seconds[2] - seconds[0]))


def test_a_block_that_turns_faster_and_faster_keeps_its_shape() -> None:
    """An uneven sole turns a block by 50 rad/s²: turned back at a steady rate, nine frames would shrink it by .01 %."""
    recorded, _ = golden()
    time_ns = np.arange(9) * 11_111_111
    yaw = 0.5 * 60.0 * (time_ns * 1e-9) ** 2
    at = np.exp(1j * yaw)[:, None] * (SQUARE_M @ [1.0, 1j])
    track = RunTrack(
        sample=recorded.samples[0],
        time_ns=time_ns,
        pose=np.column_stack([np.zeros((9, 2)), yaw]).astype(np.float64),
        corner_m=np.stack([at.real, at.imag], axis=-1).astype(np.float64),
        level_ns=0, tilt_ns=0, slip_ns=1, stop_ns=time_ns[-1], end_ns=time_ns[-1],
        sigma_m=1e-5, sigma_rad=1e-3, corner_sigma_m=1e-5,
    )  # fmt: skip
    row = np.array([stretch(0, track, 0, int(time_ns[-1]) + 1, moving=True)], dtype=STRETCH)
    np.testing.assert_allclose(np.linalg.norm(row["corner_m"][0], axis=1), np.linalg.norm(SQUARE_M, axis=1), rtol=1e-9)


def test_a_shift_in_a_direction_of_the_camera_is_found_beside_a_sag() -> None:
    """Planted and fitted, in metres of a vertical plate; the block's rest before its slides shows both."""
    planted = {"shift_m": 1e-3, "fixed_x_m": -6e-4, "fixed_y_m": 8e-4}
    sag = catalogue()["camera_sag"]
    evidence = evidence_with(Model(mu_s=0.35, scatter=0.05).with_term(Term(sag, planted)), seed=7)
    plain = fit(evidence, Model(mu_s=0.35), ())
    found = fit(evidence, plain.model.with_term(Term(sag, sag.neutral())), [sag], noise=plain.noise)
    (values,) = [term.values for term in found.model.terms if term.effect is sag]
    for name, value in planted.items():
        assert abs(values[name] - value) < max(3.3 * found.sd("camera_sag", name), 1e-5), name
        assert found.sd("camera_sag", name) < 2e-4


def test_a_block_that_turns_does_not_seem_to_shrink() -> None:
    """Windows of a slide in which friction acts 0.5 mm beside the mass: no strain beyond its noise."""
    model = Model(mu_s=0.35).with_term(Term(catalogue()["uneven_contact"], {"x_m": 5e-4, "y_m": 3e-4, "lead": 0.0}))
    shape = evidence_with(model, seed=3).channel("shape")
    assert shape is not None
    strain = shape.residual(Model(mu_s=0.35)).reshape(-1, 3)
    sliding = shape.rows.covariates["speed"][::3] > 0.02
    assert sliding.sum() > 20
    area = 0.5 * strain[sliding, :2].sum(axis=1)
    error = np.std(area) / np.sqrt(len(area))
    assert abs(area.mean()) < 3.3 * error


def test_no_turn_is_a_strain_and_a_shear_is_one_however_the_mark_lies() -> None:
    """A mark that is sheared by a twentieth shows half of that, and the half of its square along the rows."""
    angles = np.linspace(0.0, 6.0, 7)
    turn = np.stack(
        [np.stack([np.cos(angles), -np.sin(angles)], -1), np.stack([np.sin(angles), np.cos(angles)], -1)], -2
    )
    sheared = SQUARE_M @ np.array([[1.0, 0.05], [0.0, 1.0]]).T
    gradient = gradient_per_m(SQUARE_M)
    for mark, strain in ((SQUARE_M, (0.0, 0.0, 0.0)), (sheared, (0.0, 0.5 * 0.05**2, 0.5 * 0.05))):
        found = strain_of(mark @ np.swapaxes(turn, 1, 2) + 0.02, gradient)
        np.testing.assert_allclose(found, np.broadcast_to(strain, (7, 3)), atol=1e-12)


@pytest.mark.parametrize("lens", [0.05, -0.03])
def test_the_size_of_a_lens_is_not_off_by_the_marks_own_strain(lens: float) -> None:
    """The mean of 30 sessions is within three standard errors; with medians it was 0.6 to 1 % too small."""
    rng = np.random.default_rng(9)
    effect, found = catalogue()["lens_distortion"], list[float]()
    model = Model(mu_s=0.35).with_term(Term(effect, {"k1": lens}))
    for _ in range(30):
        place_m = 0.028 * np.sqrt(rng.uniform(0.0, 1.0, 300)) * np.exp(2j * np.pi * rng.uniform(0.0, 1.0, 300))
        view = marks_at(np.stack([place_m.real, place_m.imag], axis=-1))
        seen = view.point_m + model.seen(view)
        xx, yy, xy = rng.normal((0.002, -0.001, 0.0005), 4e-4, (300, 3)).T
        own = np.stack([np.stack([xx, xy], axis=-1), np.stack([xy, yy], axis=-1)], axis=-2)
        corner_m = seen + 0.75 * SQUARE_M @ own
        shape = Shape(rows_for(900), corner_m, mark_m=0.75 * SQUARE_M, view=view, spread_s=np.zeros(300))
        found.append(lens_of(shape) / lens - 1.0)
    assert abs(np.mean(found)) < max(3.0 * np.std(found) / np.sqrt(30), 5e-4)


def test_a_slide_shows_the_read_out_of_a_picture_with_a_lens() -> None:
    """A read-out that is off by a fortieth leaves five times as much of slides at 0.2 m/s as the true one.

    Without the lens's share in the row, and the gain in speed until it is read, a lens of -.05 made it 4 % too small.
    """
    rng, model = np.random.default_rng(11), Model(mu_s=0.35)
    for name, values in (("rolling_shutter", {"readout_s": 0.02}), ("lens_distortion", {"k1": -0.05})):
        effect = catalogue()[name]
        model = model.with_term(Term(effect, {**effect.neutral(), **values}))
    way_rad, place_m = rng.uniform(0.0, 2.0 * np.pi, 200), rng.uniform(-0.02, 0.02, (200, 2))
    way = np.column_stack([np.cos(way_rad), np.sin(way_rad)])
    true = marks_at(place_m).moving(0.2 * way, 2.0 * way)
    seen = [shown_after(true, time_s, model) for time_s in (-1e-3, 0.0, 1e-3)]
    velocity, acceleration = (seen[2] - seen[0]) / 2e-3, (seen[2] - 2.0 * seen[1] + seen[0]) / 1e-6
    view = true.moving(velocity.mean(axis=1), acceleration.mean(axis=1))
    shape = Shape(rows_for(600), seen[1], mark_m=0.75 * SQUARE_M, view=view, spread_s=np.full(200, 1e-3))
    off = model.with_term(Term(catalogue()["rolling_shutter"], {"readout_s": 0.0195, "axis_later": 0.0}))
    right, wrong = (np.std(shape.residual(each)) for each in (model, off))
    assert wrong > 5.0 * right


def shown_after(view: View, time_s: float, model: Model) -> Array:
    """The corners (n, 4, 2), m, that the picture shows after a time, s, of marks that gain speed evenly."""
    then = view.later(np.full((len(view.tilt_rad), 4), time_s))
    then = then.moving(view.velocity_m_s + time_s * view.acceleration_m_s2, view.acceleration_m_s2)
    return then.point_m + model.seen(then)


def marks_at(place_m: Array) -> View:
    """Marks of 7.5 mm at rest on a level plate, with their middles at places (n, 2), m."""
    zero = np.zeros(len(place_m))
    return View(
        point_m=0.75 * SQUARE_M + place_m[:, None, :],
        on_block=True,
        velocity_m_s=np.zeros((len(place_m), 2)),
        yaw_rate_rad_s=zero,
        tilt_rad=zero,
        down_rad=zero,
        rest_s=zero,
        limit_rad=np.full(len(place_m), np.nan),
        side_m=0.0075,
        camera_height_m=0.3,
        image_centre_m=np.zeros(2),
        row_m=np.array([0.0, -1.0]),
        image_size_m=0.1,
    )


def rows_for(count: int) -> Rows:
    """Rows of equal noise, each of a run of its own."""
    number, one = np.arange(count), np.ones(count)
    return rows_of({"run": number, "from_ns": number, "to_ns": number, "sigma": one}, {})


def lens_of(shape: Shape) -> float:
    """The lens with the least squares of a shape's residuals."""
    lens = catalogue()["lens_distortion"]

    def squares(size: float) -> float:
        residual = shape.residual(Model(mu_s=0.35).with_term(Term(lens, {"k1": size})))
        return float(residual @ residual)

    found: Any = minimize_scalar(squares, bounds=(-0.1, 0.1), method="bounded", options={"xatol": 1e-7})
    return float(found.x)


def test_what_rows_have_in_common_is_known_by_the_best_of_them() -> None:
    """A mark seen better and better: the mean of all rows would be off by more than the good rows' noise.

    The standardised mean of 40 good rows beside 160 that are twenty times worse is that of the good rows.
    """
    rng = np.random.default_rng(5)
    sigma = np.repeat([1e-4, 2e-3], [40, 160])
    found = [common(3e-3 + sigma[:, None] * rng.normal(size=(200, 3)), 1 / sigma**2) for _ in range(100)]
    pulls = (np.array(found) - 3e-3) / (1e-4 / np.sqrt(40))
    assert pulls.std() == pytest.approx(1.0, abs=0.15)
