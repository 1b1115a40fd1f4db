"""A plate that takes up the play of a reversal is seen by whole windows, and not only at their nodes."""

from __future__ import annotations

import numpy as np
import pytest

from station.diagnosis.observations.moments import Moments, RunFacts
from station.diagnosis.observations.plate import Attitude, Times
from station.diagnosis.observations.window_frames import WindowFrames
from station.diagnosis.observations.windows import FINE_NODES, FRAMES, NODES, WEIGHTS, weight_of
from station.physics.catalogue import catalogue
from station.physics.contact import Array
from station.physics.effects import backlash
from station.physics.model import Model, Term
from station.physics.reversals import SWINGS

HALF_RAD, SPEEDING_RAD_S2, TILT_RAD = 0.009, 4.0, 0.35
TAKEN_UP_S = (4.0 * HALF_RAD / SPEEDING_RAD_S2) ** 0.5
HALF_S = 0.045
FRAMES_AT = np.linspace(-1.0, 1.0, FRAMES)
WITH_PLAY = Model(mu_s=0.36, terms=(Term(catalogue()["backlash"], {"half_width_rad": HALF_RAD}),))


def plate_at(seconds: Array) -> Attitude:
    """A plate that turns round at 0 s and comes down about −y, ever faster."""
    since = np.maximum(seconds, 0.0)
    gone, rate, zero = 0.5 * SPEEDING_RAD_S2 * since**2, SPEEDING_RAD_S2 * since, np.zeros(len(seconds))
    tilt = TILT_RAD - gone
    down = np.array([0.0, -1.0, 0.0])
    return Attitude(
        gravity=np.column_stack([np.sin(tilt), zero, -np.cos(tilt)]),
        rate_rad_s=np.outer(rate, down),
        acceleration_rad_s2=np.outer(np.where(seconds > 0.0, SPEEDING_RAD_S2, 0.0), down),
        rising=np.where(seconds > 0.0, -1.0, 1.0),
        gone_rad=np.where(seconds > 0.0, gone, np.inf),
        swing_rad=np.full((len(seconds), SWINGS), np.inf),
        step_s=since,
    )


def moments_at(seconds: Array, **more: object) -> Moments:
    one = np.ones(1)
    facts = RunFacts(
        number=one, rest_ns=np.zeros(1, dtype=np.int64), mount_rad=one, mass_kg=one, area_m2=one, temperature_c=one,
        relative_humidity=one, dwell_s=one,
    )  # fmt: skip
    time_ns: Times = np.round(seconds * 1e9).astype(np.int64)
    run = np.zeros(len(seconds), dtype=np.int64)
    return Moments(time_ns=time_ns, run=run, facts=facts, attitude=lambda late_s: plate_at(seconds - late_s), **more)  # type: ignore[arg-type]


def curvature_of(times: Array) -> Array:
    """The weights (k,), 1/s², of places at `times` (k,), from −1 to 1, that give the mean acceleration of a window."""
    return 2.0 * np.linalg.pinv(np.column_stack([np.ones_like(times), times, times**2]))[2] / HALF_S**2


def mean_in_a_window(late: float, model: Model = WITH_PLAY) -> float:
    """The mean acceleration about y, rad/s², of a window in which play is gone `late` of its half after the middle."""
    middle = TAKEN_UP_S - late * HALF_S
    frames = WindowFrames(lambda: moments_at(middle + HALF_S * FRAMES_AT), curvature_of(FRAMES_AT)[None])
    nodes = moments_at(middle + HALF_S * NODES, evened=frames.evened)
    return float(WEIGHTS @ nodes.loads(model).contact.acceleration_rad_s2[:, 1])


@pytest.mark.parametrize("late", np.linspace(-0.6, 0.6, 7))
def test_a_window_has_the_whole_jump_of_the_rate(late: float) -> None:
    """The mean acceleration of a window is that of the rate at its moments, wherever in it the play is taken up."""
    middle, inside = TAKEN_UP_S - late * HALF_S, np.linspace(-1.0, 1.0, 4001)
    time_s = middle + HALF_S * inside
    density = np.interp(inside, FINE_NODES, weight_of(FRAMES_AT))
    density /= np.trapezoid(density, time_s)
    # By parts: the weight vanishes at both ends, so the mean of an acceleration is that of -rate times its slope.
    rate = np.where(time_s > TAKEN_UP_S, plate_at(time_s).rate_rad_s[:, 1], 0.0)
    jump = -float(np.trapezoid(rate * np.gradient(density, time_s), time_s))
    assert mean_in_a_window(late) == pytest.approx(jump, rel=0.02)


def test_it_changes_smoothly_with_the_play() -> None:
    """A fit climbs by slopes: small plays, that are taken up between two frames, change a window evenly, too."""
    small = [
        Model(mu_s=0.36, terms=(Term(catalogue()["backlash"], {"half_width_rad": half}),))
        for half in np.linspace(1e-4, 2e-3, 100)
    ]
    means = np.array([mean_in_a_window(1.0, model) for model in small])
    assert np.abs(np.diff(means)).max() < 0.05 * np.ptp(means)


@pytest.mark.parametrize("taken_up", [0.15, 0.6])
def test_how_fast_the_rate_is_taken_up_matters_little(taken_up: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Half or twice as much of the play changes a window's mean acceleration by some per cent of the greatest."""
    weight = weight_of(FRAMES_AT)[None]

    def means() -> Array:
        every = []
        for late in np.linspace(-0.9, 0.9, 19):
            middle = TAKEN_UP_S - late * HALF_S
            acceleration = moments_at(middle + HALF_S * FINE_NODES).loads(WITH_PLAY).contact.acceleration_rad_s2
            every.append(weight[0] @ acceleration[:, 1])
        return np.array(every)

    as_it_is = means()
    monkeypatch.setattr(backlash, "TAKEN_UP", taken_up)
    change = float(np.sqrt(np.mean(np.square(means() - as_it_is))) / np.abs(as_it_is).max())
    print(f"\nTAKEN_UP {taken_up:g}: the means change by {100 * change:.1f} %")
    assert change < 0.12


def test_a_plate_without_play_is_as_reported() -> None:
    plain = moments_at(0.05 + HALF_S * NODES)
    np.testing.assert_array_equal(
        plain.loads(Model(mu_s=0.36)).contact.acceleration_rad_s2, plain.reported.acceleration_rad_s2
    )
