"""A camera whose mount gives way in the session: the plate's own marks stand elsewhere from then on, the level too."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from shared.geometry import Array
from station.diagnosis.diagnose import examined
from station.diagnosis.observations.build import evidence_of
from station.diagnosis.observations.channel import Channel
from station.diagnosis.observations.marks import Mount
from station.diagnosis.observations.setting import Setting
from station.diagnosis.result import Diagnosis
from station.physics.catalogue import catalogue
from station.physics.effect import Effect
from station.physics.model import Model
from station.signals.session import Signals
from tests.unit.diagnosis.recorded import OPENING_RADIUS_M, joined, session

SETTING = Setting(opening_radius_m=OPENING_RADIUS_M)
MARK_PX = np.array([[40.0, 40.0], [64.0, 40.0], [64.0, 64.0], [40.0, 64.0]])
NOISE_PX = 0.05
SLIPPED_PX, FROM_RUN = np.array([1.0, -2.0]), 20


@cache
def twice() -> Signals:
    """48 runs without any effect."""
    return joined([session(), session()], runs=len(session().samples))


@cache
def watched(slips: bool) -> Signals:
    """The session with a fiducial on its plate, which stands elsewhere from a run on if the mount `slips`."""
    recorded = twice()
    corners, rng = recorded.corners, np.random.default_rng(6)
    begin = min(sample.start_ns for sample in recorded.samples if sample.run >= FROM_RUN)
    seen: Array = MARK_PX + rng.normal(0.0, NOISE_PX, (len(corners.time_ns), 4, 2))
    if slips:
        seen = seen + SLIPPED_PX * (corners.time_ns >= begin)[:, None, None]
    fiducial = replace(corners, corner_px=seen, found=np.ones_like(corners.found))
    return replace(recorded, fiducials={7: fiducial})


@cache
def told(slips: bool) -> Diagnosis:
    return examined(watched(slips), catalogue(), setting=SETTING).diagnosis


@cache
def mount(axis: str) -> Channel:
    channel = evidence_of(watched(slips=True), SETTING).channel(f"mount:{axis}")
    assert channel is not None
    return channel


def test_the_marks_places_are_those_before_each_tilt() -> None:
    for axis, shift_px in zip("xy", SLIPPED_PX * [1.0, -1.0], strict=True):  # the plate's y goes up the picture
        channel = mount(axis)
        place = channel.residual(Model(mu_s=0.35))
        later = channel.rows.covariates["run"] >= FROM_RUN - min(sample.run for sample in session().samples)
        geometry = watched(slips=True).geometry
        assert geometry is not None
        shift_m = 1e-3 * geometry.mm_per_px * shift_px
        assert place[later].mean() - place[~later].mean() == pytest.approx(
            shift_m, rel=0.05
        )  # the mark is far from the middle
        assert abs(place.mean()) < 1e-12


def test_a_plate_that_was_turned_in_its_own_mount_is_no_camera_that_slipped() -> None:
    place, turned = np.array([1e-3, -2e-3, 1.01e-3, -2.01e-3]), np.array([0.0, 1.57, 0.0, 1.57])
    rows = mount("x").rows.chosen(np.arange(4))
    found = Mount(rows, "x", place, turned).residual(Model(mu_s=0.35))
    assert found == pytest.approx([-5e-6, 5e-6, 5e-6, -5e-6])


@pytest.mark.parametrize("effect", catalogue().values(), ids=lambda effect: effect.id)
def test_no_effect_changes_them(effect: Effect) -> None:
    assert not mount("x").changed_by(effect)


def test_a_mount_that_slips_is_located() -> None:
    answer = told(slips=True)
    assert answer.global_p < 1e-3
    assert any(place.channel.startswith("mount") and place.covariate == "run" for place in answer.located)
    assert {effect.id for effect in answer.effects if effect.verdict == "supported"} == {"other"}


def test_of_a_mount_that_holds_nothing_is_told() -> None:
    answer = told(slips=False)
    assert answer.names == ()
    assert not any(place.channel.startswith("mount") for place in answer.located)
