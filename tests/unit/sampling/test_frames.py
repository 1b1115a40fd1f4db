"""The camera's messages: frames of now go on to the phase, others mark the run."""

from __future__ import annotations

from dataclasses import replace

import pytest

from shared.messages import REPEATED
from station.sampling.frames import Frames
from station.sampling.plan import Plan
from station.sampling.state import FROZEN, LATE
from tests.unit.sampling.given_phases import SECOND_NS, corners, phases
from tests.unit.sampling.scripted_rig import GEOMETRY

PLAN = Plan()


def test_a_frame_of_now_is_seen_and_found() -> None:
    found = phases(PLAN, phase="DWELL")
    now_ns = found.state.now_ns
    Frames(PLAN, found).corners(corners(now_ns))
    assert (found.state.seen_ns, found.state.found_ns, found.state.blind) == (now_ns, now_ns, "")


def test_a_frame_without_the_mark_is_seen_alone_and_another_marks_is_not() -> None:
    found = phases(PLAN, phase="DWELL")
    frames, now_ns = Frames(PLAN, found), found.state.now_ns
    frames.corners(corners(now_ns, marker_id=2))
    assert not found.state.seen_ns
    frames.corners(corners(now_ns, found=False, corners_px=()))
    assert (found.state.seen_ns, found.state.found_ns) == (now_ns, 0)


@pytest.mark.parametrize(("phase", "flags"), [("TILT", ["disturbed_late_frames"]), ("RETURN", [])])
def test_a_late_frame_decides_nothing_and_marks_a_slide(phase: str, flags: list[str]) -> None:
    found = phases(PLAN, phase=phase)
    late_ns = found.state.now_ns - round((PLAN.silence_s + 0.1) * SECOND_NS)
    Frames(PLAN, found).corners(corners(late_ns))
    assert (found.state.seen_ns, found.state.blind, found.state.run.flags) == (0, LATE, flags)


def test_the_same_frame_again_is_a_frozen_camera() -> None:
    found = phases(PLAN, phase="DWELL")
    frames = Frames(PLAN, found)
    frames.corners(corners(found.state.now_ns, found=False, corners_px=(), reason=REPEATED))
    assert (found.state.seen_ns, found.state.blind) == (0, FROZEN)


@pytest.mark.parametrize(
    ("phase", "changed", "flags"),
    [
        ("TILT", {"mm_per_px": 0.2}, ["disturbed_calibration"]),
        ("TILT", {"stamp_ns": 7}, []),
        ("DWELL", {"mm_per_px": 0.2}, []),
    ],
)
def test_another_calibration_in_the_middle_of_a_run_marks_it(
    phase: str, changed: dict[str, float], flags: list[str]
) -> None:
    found = phases(PLAN, phase=phase)
    Frames(PLAN, found).geometry(replace(GEOMETRY, **changed))
    assert found.state.run.flags == flags
    assert found.tracks.geometry == replace(GEOMETRY, **changed)
