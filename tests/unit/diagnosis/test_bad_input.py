"""Recordings that say too little: an answer all the same, with the reason, and nothing made up."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from shared.messages import Sample
from station.diagnosis.diagnose import examined
from station.diagnosis.next_experiment.recommended import recommended
from station.diagnosis.observations.setting import Setting
from station.diagnosis.report.page import html_page
from station.diagnosis.report.summary import summary
from station.diagnosis.result import Diagnosis
from station.physics.catalogue import catalogue
from station.signals.session import Signals
from tests.unit.diagnosis.recorded import OPENING_RADIUS_M, session
from tests.unit.diagnosis.tables import samples

SETTING = Setting(opening_radius_m=OPENING_RADIUS_M)
BY_DIRECTION = ("plate_anisotropy", "object_anisotropy", "one_way_friction")


def answered(recorded: Signals | list[Sample]) -> Diagnosis:
    """The diagnosis, with its report and summary made: neither may fail."""
    found = recommended(examined(recorded, catalogue(), setting=SETTING), catalogue())
    assert html_page(found.diagnosis, found.pictures)
    assert summary(found.diagnosis)
    return found.diagnosis


def nothing_said(found: Diagnosis, *words: str) -> None:
    assert found.verdict == "untestable"
    assert found.effects == ()
    assert found.located == ()
    assert found.next_experiment is None
    assert set(found.untestable) == set(catalogue())
    assert found.notes[0].count("\n") == 0
    for word in words:
        assert word in " ".join(found.notes)


def test_too_few_runs() -> None:
    nothing_said(answered(samples(runs=12)), "expected at least 20 runs", "found 12", "record more runs")


def test_an_empty_table() -> None:
    nothing_said(answered([]), "found none")


def test_a_table_whose_angles_make_no_sense() -> None:
    wrong = [replace(sample, onset_angle_rad=25.0) for sample in samples()]
    nothing_said(answered(wrong), "no row of the table has an onset angle between")


@pytest.mark.parametrize("slid", [0, 9])
def test_runs_in_which_nothing_slid_leave_no_friction_to_judge(slid: int) -> None:
    held = [replace(sample, censored=sample.run > slid) for sample in samples()]
    nothing_said(answered(held), f"runs in which the block slid, found {slid}", "tilt further")


def test_one_direction_cannot_show_what_depends_on_the_direction() -> None:
    found = answered(samples(directions=1))
    assert found.verdict == "not supported"
    for name in BY_DIRECTION:
        assert found.untestable[name]
    assert not set(BY_DIRECTION) & set(found.names)


def test_one_mass_cannot_show_what_depends_on_the_load() -> None:
    found = answered(samples())
    for name in ("load_dependence", "adhesion"):
        assert "second mass" in found.untestable[name]


def test_a_whole_session_can_be_judged() -> None:
    """The sessions below are untestable for what they lack of this one."""
    found = answered(session())
    assert found.used_runs == 24
    assert found.verdict != "untestable"


def _without(**changes: Callable[[Signals], object]) -> Signals:
    whole = session()
    return replace(whole, **{name: change(whole) for name, change in changes.items()})  # pyright: ignore[reportArgumentType]


def test_without_the_attitude_nothing_can_be_judged() -> None:
    bare = _without(attitude=lambda whole: whole.attitude.between(0, 1))
    nothing_said(answered(bare), "no attitude of the plate was recorded")


def test_without_a_calibration_there_are_onsets_but_no_slides() -> None:
    found = examined(_without(geometry=lambda _: None), catalogue(), setting=SETTING)
    assert "no calibration was recorded" in " ".join(found.diagnosis.notes)
    assert {channel.name for channel in found.pictures.channels} <= {"onset"}
    assert html_page(found.diagnosis, found.pictures)


def test_without_corners_the_samples_still_count() -> None:
    found = answered(_without(corners=lambda whole: whole.corners.between(0, 1)))
    assert found.total_runs == 24


def test_without_samples_there_are_no_runs() -> None:
    nothing_said(answered(_without(samples=lambda _: ())), "found none")


def test_numbers_that_are_none_do_not_stop_it() -> None:
    whole = session()
    corners = whole.corners.corner_px.copy()
    corners[::7] = np.nan
    found = examined(
        replace(whole, corners=replace(whole.corners, corner_px=corners)), catalogue(), setting=SETTING
    ).diagnosis
    assert found.verdict in ("supported", "not supported", "indistinguishable", "untestable")
