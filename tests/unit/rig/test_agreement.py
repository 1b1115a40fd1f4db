"""A camera agent with another rig file than the station's is told by name."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from pi_agent.calibration.model import geometry_message, nominal
from shared.clock import SystemClock
from shared.memory_bus import MemoryBus
from shared.messages import CameraGeometry
from shared.rig import RigConfig
from station.app import assembly
from station.app.live import LiveSession
from station.app.processes import StopRequest
from station.recording.checkup.report import examine
from station.recording.checkup.rules import findings
from station.recording.reader import open_recording
from station.recording.writer import Recording
from station.rig.agreement import disagreement
from station.sampling.plan import Plan
from tests.unit.recording import session


def seen_by(rig: RigConfig) -> CameraGeometry:
    """The message of an agent with that file."""
    calibration = nominal(rig, width_px=rig.camera.width_px, height_px=rig.camera.height_px)
    return geometry_message(calibration, rig, stamp_ns=1)


RIG = assembly.rig_from(None)


@pytest.mark.parametrize("rig", [RIG, RigConfig(id="plain")], ids=["simulated", "defaults"])
def test_an_agent_with_the_same_file_agrees(rig: RigConfig) -> None:
    assert disagreement(rig, seen_by(rig)) == ""
    assert disagreement(rig, CameraGeometry()) == ""


@pytest.mark.parametrize(
    ("other", "words"),
    [
        (replace(RIG, mark=replace(RIG.mark, side_mm=RIG.mark.side_mm + 2)), "side_mm"),
        (replace(RIG, mark=replace(RIG.mark, aspect=1.25)), "aspect 1.25 (here"),
        (replace(RIG, block=replace(RIG.block, size_m=(0.01, 0.01, 0.02))), "its height, 0.02 (here"),
        (replace(RIG, camera=replace(RIG.camera, px_per_mm=7.0)), "px_per_mm 7 (here"),
        (replace(RIG, camera=replace(RIG.camera, height_mm=400.0)), "height_mm 400 (here"),
    ],
)
def test_what_another_file_says_is_named(other: RigConfig, words: str) -> None:
    assert words in disagreement(RIG, seen_by(other))


def test_a_calibration_replaces_the_view_of_the_file() -> None:
    measured = replace(seen_by(RIG), source="board", mm_per_px=0.15, camera_height_m=0.31)
    assert disagreement(RIG, measured) == ""


def test_a_session_warns_once_and_its_recording_is_told(tmp_path: Path) -> None:
    """Nobody noticed: the recording carried one rig file, and lengths by another."""
    lines = list[str]()
    path, bus = tmp_path / "a.mcap", MemoryBus(SystemClock())
    other = seen_by(replace(RIG, mark=replace(RIG.mark, side_mm=RIG.mark.side_mm + 2)))
    recording = Recording(path, provenance=session.provenance(rig_toml=RIG.text, mode="live"))
    live = LiveSession(
        bus,
        RIG,
        Plan(),
        recording=recording,
        clock=SystemClock(),
        stop=stopped(),
        on_line=lambda _, line: lines.append(line),
    )
    for _ in range(3):
        bus.publish("camera/geometry", other)
    live.run()
    assert [line for line in lines if "rig file" in line] == [disagreement(RIG, other)]
    reader = open_recording(path)
    assert [finding.sentence for finding in findings(examine(reader)) if finding.rule == "rig"] == [
        disagreement(RIG, other)
    ]


def stopped() -> StopRequest:
    """A session that ends at once."""
    stop = StopRequest()
    stop.ask("stopped by the test")
    return stop
