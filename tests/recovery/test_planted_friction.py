"""A lockstep session gives back what is planted in the twin: through arm, camera, slip rule and onset fit."""

import math
from dataclasses import replace

import numpy as np
import pytest

from shared.config import Table
from shared.messages import Sample, TwinScene
from shared.rig import RigConfig
from station.app import assembly
from station.app.lockstep import Lockstep
from station.sampling.plan import Plan, TiltPlan

FREE_OF_BORDER_M = 0.03
"""A block that starts nearer to the centre leans on no foam: the paper's border filter, by place."""


def session(*, samples: int, seed: int, rate_deg_s: float = 5.0, **twin: float | str) -> list[tuple[Sample, float]]:
    """The samples of a simulated session that no border has touched, each with the friction drawn for it (mu)."""
    rig: RigConfig = replace(assembly.rig_from(None), twin=Table(dict(twin)))
    # Without narrowing, so that every draw can be reached and none is censored.
    plan = Plan(samples=samples, seed=seed, tilt=TiltPlan(adapt_after=0, rate_deg_s=rate_deg_s))
    lockstep = Lockstep(rig, plan, recording=None)
    scenes: list[TwinScene] = []
    found: list[tuple[Sample, float]] = []
    drawn: dict[int, float] = {}

    def on_scene(scene: TwinScene) -> None:
        scenes[:] = [scene]

    def on_slip(run: int) -> None:
        drawn[run] = scenes[0].mu

    lockstep.bus.subscribe("truth/scene", lambda received: on_scene(received.message))  # pyright: ignore[reportArgumentType]
    lockstep.bus.subscribe(
        "session/event",
        lambda received: on_slip(received.message.run) if received.message.phase == "SLIP" else None,  # pyright: ignore[reportAttributeAccessIssue]
    )
    lockstep.bus.subscribe("session/sample", lambda received: found.append((received.message, 0.0)))  # pyright: ignore[reportArgumentType]
    outcome = lockstep.run()
    assert outcome.fault == ""
    assert outcome.samples == samples
    inside = [sample for sample, _ in found if math.hypot(sample.start_x_m, sample.start_y_m) < FREE_OF_BORDER_M]
    return [(sample, drawn[sample.run]) for sample in inside if not sample.censored]


@pytest.mark.parametrize("rate_deg_s", [2.0, 8.0])
def test_without_scatter_every_onset_is_the_planted_angle(rate_deg_s: float):
    found = session(samples=5, seed=3, rate_deg_s=rate_deg_s, mean_mu=0.5, scatter=0.0)
    errors = np.degrees([sample.onset_angle_rad - math.atan(0.5) for sample, _ in found])
    assert len(errors) >= 2
    assert np.abs(errors).max() < 0.15


def test_with_scatter_each_onset_is_its_own_draw_and_their_mean_the_planted_one():
    planted, scatter = 0.35, 0.2
    found = session(samples=24, seed=11, mean_angle_rad=planted, scatter=scatter)
    onsets = np.array([sample.onset_angle_rad for sample, _ in found])
    draws = np.arctan([mu for _, mu in found])
    assert len(found) >= 10
    assert np.degrees(np.abs(onsets - draws)).max() < 0.2
    assert abs(onsets.mean() - planted) < 3 * scatter * planted / math.sqrt(len(onsets))
    assert 0.5 * scatter * planted < onsets.std(ddof=1) < 1.8 * scatter * planted


def test_an_ellipse_fixed_in_the_plate_is_seen_by_direction():
    # Along the plate's x (directions 1 and 3) friction is higher than along y (0 and 2) by the planted ratio.
    found = session(samples=12, seed=5, mean_mu=0.4, scatter=0.0, ratio=1.3, axis_rad=0.0, fixed_in="plate")
    mu = {parity: [math.tan(s.onset_angle_rad) for s, _ in found if s.direction % 2 == parity] for parity in (0, 1)}
    assert min(map(len, mu.values())) >= 1
    assert np.mean(mu[1]) / np.mean(mu[0]) == pytest.approx(1.3, rel=0.03)
