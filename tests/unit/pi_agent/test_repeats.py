"""A frame that was there before is none: whatever the camera's noise, and whatever its stamps say."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pi_agent.cameras import CameraInfo, Frame
from pi_agent.diagnosis import Diagnosis
from pi_agent.observer import Observer
from pi_agent.synthetic_view import SyntheticOptions, SyntheticView
from shared.messages import REPEATED, MarkerCorners
from tests.unit.pi_agent.rigs import rig, scene

FRAME_NS = 11_111_111
QUIET = SyntheticOptions(full_scale_e=1e12, read_noise_e=0.0)


def seen(options: SyntheticOptions | None, *, drawn: int, shown: int, step_ns: int) -> list[MarkerCorners]:
    """`drawn` frames, of which the last is shown again until there are `shown`, `step_ns` after each other."""
    view = SyntheticView(rig(), rng=np.random.default_rng(3), options=options)
    observer = Observer(rig(), view.info)
    reports: list[MarkerCorners] = []
    frame = Frame(view.frame(scene(), 0), 0, 0)
    for number in range(shown):
        if number < drawn:
            frame = Frame(view.frame(scene(), 0), number * FRAME_NS, number)
        elif step_ns:
            frame = dataclasses.replace(frame, capture_ns=frame.capture_ns + step_ns, seq=number)
        reports.append(observer.block(frame))
    return reports


def test_a_camera_with_noise_gives_no_picture_twice():
    reports = seen(None, drawn=40, shown=40, step_ns=FRAME_NS)
    assert all(report.found for report in reports)
    assert not any(report.noiseless for report in reports)


@pytest.mark.parametrize("step_ns", [FRAME_NS, 0])
def test_the_same_picture_again_shows_nothing_and_is_said(step_ns: int):
    reports = seen(None, drawn=5, shown=9, step_ns=step_ns)
    assert [report.found for report in reports] == [True] * 5 + [False] * 4
    assert {report.reason for report in reports[5:]} == {REPEATED}
    assert all(report.corners_px == () for report in reports[5:])


@pytest.mark.parametrize("buffers", [2, 3, 32])
def test_buffers_that_are_handed_out_in_turn_show_nothing(buffers: int):
    """Each picture differs from the one before it: three in turn gave a run that was kept, an onset 9 degrees off."""
    view = SyntheticView(rig(), rng=np.random.default_rng(3))
    observer, kept = Observer(rig(), view.info), [view.frame(scene(), 0) for _ in range(buffers)]
    shown = [kept[number % buffers] for number in range(3 * buffers)]
    reports = [observer.block(Frame(image, number * FRAME_NS, number)) for number, image in enumerate(shown)]
    assert all(report.found for report in reports[:buffers])
    assert {report.reason for report in reports[buffers:]} == {REPEATED}


def test_without_noise_the_same_picture_is_a_new_frame_while_its_stamps_go_on():
    reports = seen(QUIET, drawn=9, shown=9, step_ns=FRAME_NS)
    assert all(report.found and report.noiseless for report in reports)


def test_without_noise_a_frozen_camera_is_told_by_its_stamps():
    reports = seen(QUIET, drawn=5, shown=9, step_ns=0)
    assert [report.found for report in reports] == [True] * 5 + [False] * 4


def test_a_frozen_camera_is_a_fault_in_one_sentence():
    info = CameraInfo(name="test", width_px=600, height_px=600, rate_hz=90.0)
    diagnosis, grey = Diagnosis(info), np.full((600, 600), 120, dtype=np.uint8)
    for stamp_ns in (0, 600_000_000):
        diagnosis.see(Frame(grey, stamp_ns, 0), MarkerCorners(reason=REPEATED))
    assert diagnosis.fault.startswith("The camera is frozen")
