"""Slips are read from path and load together, so that stamps that are known to be late must be allowed for there."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from shared.geometry import Array
from station.diagnosis.observations.build import evidence_of
from station.diagnosis.observations.onsets import Onsets
from station.diagnosis.observations.rig_offsets import RigOffsets
from station.diagnosis.observations.setting import Setting
from station.physics.catalogue import catalogue
from station.physics.model import Model, Term
from station.signals.session import Signals
from tests.unit.diagnosis.recorded import OPENING_RADIUS_M, later, session
from tests.unit.diagnosis.test_plate import moving_plate

LATE_S, ASTRAY_S, SIGMA_RAD = 0.06, 0.02, 5e-4


def _late(signals: Signals, late_s: float) -> Signals:
    """The session by a camera whose stamps are late by `late_s`, and whose rig read the slips ASTRAY_S astray."""
    seen, rng = later(signals, round(late_s * 1e9), 0), np.random.default_rng(8)
    astray = np.round(1e9 * rng.normal(0.0, ASTRAY_S, len(signals.samples))).astype(int).tolist()
    samples = tuple(
        replace(sample, slip_ns=sample.slip_ns + by, onset_sigma_rad=SIGMA_RAD)
        for sample, by in zip(seen.samples, astray, strict=True)
    )
    return replace(seen, attitude=signals.attitude, motions=signals.motions, samples=samples)


@cache
def _onsets(stamped_s: float | None, *, late_s: float) -> Onsets:
    """The onsets of the session `_late` by so much, or of the session itself, with slips read by that lateness."""
    signals = session() if stamped_s is None else _late(session(), stamped_s)
    channel = evidence_of(signals, Setting(opening_radius_m=OPENING_RADIUS_M), RigOffsets(late_s)).onsets
    assert isinstance(channel, Onsets)
    return channel


@pytest.fixture(scope="module")
def errors() -> dict[float, float]:
    """The errors (rms) of the runs' log friction in the late session, by the lateness for which slips were read."""
    plain, delay = Model(mu_s=0.35), catalogue()["clock_offset"]
    true = _onsets(None, late_s=0.0).residual(plain)
    model = replace(plain, terms=(Term(delay, {"delay_s": LATE_S, "of_arm": 0.0}),))
    return {
        late_s: float(np.sqrt(np.mean(np.square(_onsets(LATE_S, late_s=late_s).residual(model) - true))))
        for late_s in (0.5 * LATE_S, LATE_S)
    }


def test_slips_are_found_where_they_were_by_the_right_clock(errors: dict[float, float]) -> None:
    """The error is that of a re-read onset of this session: half a thousandth of a radian is .0015 of friction."""
    assert errors[LATE_S] < 0.003


def test_a_wrong_clock_leads_them_astray(errors: dict[float, float]) -> None:
    assert errors[0.5 * LATE_S] > 2 * errors[LATE_S]


def test_the_plate_pushes_a_slip_at_the_right_moment() -> None:
    """A pivot adds at slips with late stamps what it adds with punctual ones, to a hundredth of the largest."""
    known = catalogue()
    pivot = Term(known["pivot_offset"], {"x_m": 0.0, "y_m": 0.0, "z_m": 0.3})
    delay = Term(known["clock_offset"], {"delay_s": LATE_S, "of_arm": 0.0})
    punctual = _added(_onsets(0.0, late_s=1e-9), Model(mu_s=0.35), pivot)
    late = _added(_onsets(LATE_S, late_s=LATE_S), Model(mu_s=0.35, terms=(delay,)), pivot)
    np.testing.assert_allclose(late, punctual, atol=0.01 * np.abs(punctual).max())


def _added(onsets: Onsets, model: Model, term: Term) -> Array:
    """Returns what a term adds to the runs' log friction."""
    return onsets.residual(replace(model, terms=(*model.terms, term))) - onsets.residual(model)


def test_a_plate_is_asked_by_late_stamps() -> None:
    plate, time_ns = moving_plate(), np.linspace(3e9, 12e9, 50).astype(np.int64)
    late = plate.for_stamps(late_s=LATE_S)
    there, here = late.at(time_ns + round(LATE_S * 1e9)), plate.at(time_ns)
    np.testing.assert_allclose(there.gravity, here.gravity, atol=1e-9)
    np.testing.assert_array_equal(late.steps_between(0, 2**62), plate.steps_between(0, 2**62) + round(LATE_S * 1e9))
