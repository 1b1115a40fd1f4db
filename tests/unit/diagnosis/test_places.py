"""The columns of the places, and what of a drop of friction is seen where.

Friction along a slide is compared within its run by what that friction itself sets.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from station.diagnosis.inference.fit import fit
from station.diagnosis.observations.build import evidence_of
from station.diagnosis.observations.channel import Channel, rows_of
from station.diagnosis.observations.setting import Setting
from station.diagnosis.search.locate import smooth_part, summary_of
from station.diagnosis.search.places import (
    _bases,  # pyright: ignore[reportPrivateUsage]
    places_of,
)
from station.physics.catalogue import catalogue
from station.physics.contact import Array
from station.physics.model import Model, Term
from station.simulators.simulator import simulator
from tests.unit.diagnosis.recorded import OPENING_RADIUS_M, golden, joined

RUNS, WINDOWS = 30, 4


class _Friction(Channel):
    """Four windows of each slide, or, as an onset has it, one row of each run; with the time since the onset."""

    name = "along"
    title = "the friction along the slide"
    phase = "slide"
    unit = "relative friction"
    shares_friction = True

    def __init__(self, windows: int) -> None:
        rng = np.random.default_rng(1)
        run, count = np.repeat(np.arange(RUNS), windows), RUNS * windows
        late = rng.normal(0.0, 0.02, RUNS)
        times = np.zeros(count, dtype=np.int64)
        super().__init__(
            rows_of(
                {"run": run, "from_ns": times, "to_ns": times, "sigma": np.ones(count)},
                {
                    "slide_time": late[run] + 0.1 * np.tile(np.arange(windows), RUNS),
                    "temperature": rng.normal(20.0, 1.0, RUNS)[run],
                },
            )
        )

    def residual(self, model: Model) -> Array:
        return np.full(len(self), model.mu_s)


@pytest.mark.parametrize("windows", [WINDOWS, 1])
def test_the_time_since_the_onset_tells_runs_apart_only_where_each_has_one_row(windows: int) -> None:
    basis = _bases(_Friction(windows))["slide_time"].columns.reshape(RUNS, windows, -1)
    apart = np.ptp(basis, axis=0).max(axis=0)
    assert (apart < 1e-9).all() if windows > 1 else (apart > 0.1).all()
    assert np.ptp(basis, axis=1).max() > 0.1 or windows == 1


def test_what_friction_does_not_set_is_compared_between_runs() -> None:
    basis = _bases(_Friction(WINDOWS))["temperature"].columns
    assert (np.ptp(basis.reshape(RUNS, WINDOWS, -1), axis=1) < 1e-9).all()


def test_friction_across_has_no_onset_to_be_compared_with() -> None:
    across = _Friction(WINDOWS)
    across.shares_friction = False
    assert np.abs(_bases(across)["slide_time"].columns.reshape(RUNS, WINDOWS, -1).mean(axis=1)).max() > 0.1


def test_a_drop_of_friction_is_seen_along_the_slide_throughout() -> None:
    recorded, rig = golden()
    rig = replace(rig, plate=replace(rig.plate, opening_m=2 * OPENING_RADIUS_M))
    drop = Model(mu_s=0.35, terms=(Term(catalogue()["kinetic_drop"], {"drop": 0.2}),))
    session = joined([simulator("planar").repeat(recorded, drop, rig=rig) for _ in range(6)])
    evidence = evidence_of(session, Setting(opening_radius_m=OPENING_RADIUS_M))
    plain = fit(evidence, Model(mu_s=0.35), ())
    (place,) = (one for one in places_of(evidence, 0)[0] if (one.channel.name, one.covariate) == ("along", "all"))
    residual, _, size = smooth_part(plain.model, place)
    assert math.expm1(float(np.median(residual))) == pytest.approx(-0.2, abs=0.01)
    assert size > 0.9
    assert "is off by -20 % throughout" in summary_of(plain.model, place)
