"""The doctor finds each planted fault by its name, and nothing in a healthy recording."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from shared import foxglove
from shared.messages import (
    AgentStatus,
    ArmLease,
    CameraGeometry,
    ClockOffset,
    MarkerCorners,
    Message,
    MotionReport,
    RunEvent,
    Sample,
)
from station.app.commands import doctor
from station.recording.checkup.quantiles import Quantiles
from station.recording.checkup.report import examine
from station.recording.checkup.rules import findings
from station.recording.reader import open_recording
from station.recording.writer import Recording
from tests.unit.recording import session

Item = tuple[int, str, Message]
Change = Callable[[Item], Iterator[Item]]


def healthy() -> Iterator[Item]:
    """The session of the other tests, with all that the format asks for."""
    items = list(session.traffic())
    for number in range(4 * 15):
        stamp_ns = session.START_NS + number * 1_000_000_000 // 15
        items.append((stamp_ns + 3_000_000, "camera/plate", MarkerCorners(capture_ns=stamp_ns, seq=6 * number)))
    for second in range(4):
        stamp_ns = session.START_NS + second * 1_000_000_000
        stamp = foxglove.Timestamp.from_ns(stamp_ns)
        items.append((stamp_ns, "camera/calibration", foxglove.CameraCalibration(timestamp=stamp)))
        items.append((stamp_ns, "clock", ClockOffset(stamp_ns=stamp_ns, agent="arm", sigma_ns=10_000)))
    items.append((session.START_NS, "session/event", RunEvent(stamp_ns=session.START_NS, phase="SYNC")))
    for run in (1, 2):
        end_ns = session.START_NS + int(((run - 1) * session.RUN_S + 1.0) * 1e9)
        ended = MotionReport(stamp_ns=end_ns, run=run, step=1, begin_ns=end_ns - 10**9, end_ns=end_ns)
        items.append((end_ns, "arm/motion", ended))
    return iter(sorted(items, key=lambda item: item[0]))


def recorded(path: Path, change: Change, **provenance: object) -> Path:
    with Recording(path, provenance=session.provenance(**provenance)) as recording:
        for original in healthy():
            for receive_ns, topic, message in change(original):
                recording.write_message(topic, message, receive_ns=receive_ns)
    return path


def unchanged(item: Item) -> Iterator[Item]:
    yield item


def without(topic: str) -> Change:
    return lambda item: iter(() if item[1] == topic else (item,))


def thinned(topic: str, keep: int) -> Change:
    count = iter(range(10**6))
    return lambda item: iter((item,) if item[1] != topic or next(count) % keep == 0 else ())


def frames_lost(item: Item) -> Iterator[Item]:
    if not (isinstance(item[2], MarkerCorners) and item[1] == "camera/corners" and 100 <= item[2].seq < 104):
        yield item


def late(item: Item) -> Iterator[Item]:
    yield (item[0] + 20_000_000, *item[1:]) if item[1] == "camera/corners" else item


def early(item: Item) -> Iterator[Item]:
    yield (item[0] - 9_000_000, *item[1:]) if item[1] == "camera/corners" else item


def vague_clock(item: Item) -> Iterator[Item]:
    message = item[2]
    yield (*item[:2], replace(message, sigma_ns=5_000_000)) if isinstance(message, ClockOffset) else item


def dropping(item: Item) -> Iterator[Item]:
    message = item[2]
    # A hundred were dropped before the session: not its fault. Then three a second.
    yield (
        (*item[:2], replace(message, dropped=100 + message.frames // 30)) if isinstance(message, AgentStatus) else item
    )


def without_sync(item: Item) -> Iterator[Item]:
    if not (isinstance(item[2], RunEvent) and item[2].phase == "SYNC"):
        yield item


def first_run_unended(item: Item) -> Iterator[Item]:
    if not (isinstance(item[2], RunEvent) and item[2].run == 1 and item[2].phase == "DONE"):
        yield item


def first_sample_removed(item: Item) -> Iterator[Item]:
    if not (isinstance(item[2], Sample) and item[2].run == 1):
        yield item


def with_steps_of_the_sync(item: Item) -> Iterator[Item]:
    yield item
    if isinstance(item[2], RunEvent) and item[2].phase == "SYNC":
        yield from ((item[0], item[1], replace(item[2], phase=phase)) for phase in ("STEP_BEGIN", "STEP_END"))


def frozen(item: Item) -> Iterator[Item]:
    message = item[2]
    if isinstance(message, MarkerCorners) and item[1] == "camera/corners" and 100 <= message.seq < 150:
        message = replace(message, corners_px=(1.0,) * 8)
    yield item[0], item[1], message


def seconds_late(item: Item) -> Iterator[Item]:
    message = item[2]
    late = isinstance(message, MarkerCorners) and item[1] == "camera/corners" and 100 <= message.seq < 150
    yield item[0] + late * 2_000_000_000, item[1], message


def disturbed(item: Item) -> Iterator[Item]:
    message = item[2]
    yield item[0], item[1], replace(message, flags=("disturbed_cut",)) if isinstance(message, Sample) else message


def of_another_scale(item: Item) -> Iterator[Item]:
    message = item[2]
    if isinstance(message, CameraGeometry):
        message = replace(message, marker_side_m=0.6 * message.marker_side_m)
    yield item[0], item[1], message


def taken_over(item: Item) -> Iterator[Item]:
    yield item
    if isinstance(item[2], Sample):
        yield item[0] + 1, "arm/lease", ArmLease(item[0], owner=f"session {item[2].run}")


def rules(path: Path) -> set[str]:
    return {finding.rule for finding in findings(examine(open_recording(path)))}


def test_a_healthy_recording_breaks_no_rule(tmp_path: Path) -> None:
    assert rules(recorded(tmp_path / "a.mcap", unchanged)) == set()


@pytest.mark.parametrize(
    ("change", "rule"),
    [
        (without("camera/corners"), "block"),
        (without("camera/plate"), "rate"),
        (thinned("camera/corners", 2), "rate"),
        (thinned("arm/platform", 2), "rate"),
        (frames_lost, "gap"),
        (frames_lost, "missing"),
        (late, "latency"),
        (early, "clock"),
        (without("clock"), "clock"),
        (vague_clock, "clock"),
        (dropping, "dropped"),
        (without("camera/geometry"), "calibration"),
        (without("arm/motion"), "motion"),
        (without("session/event"), "runs"),
        (without_sync, "sync"),
        (first_run_unended, "runs"),
        (first_sample_removed, "runs"),
        (frozen, "frozen"),
        (seconds_late, "late"),
        (disturbed, "disturbed"),
        (taken_over, "owner"),
        (of_another_scale, "scale"),
    ],
)
def test_a_planted_fault_is_named(change: Change, rule: str, tmp_path: Path) -> None:
    assert rule in rules(recorded(tmp_path / "a.mcap", change))


def test_only_what_the_agent_dropped_in_the_session_counts(tmp_path: Path) -> None:
    assert examine(open_recording(recorded(tmp_path / "a.mcap", dropping))).session.agent_dropped == 9


def test_the_sync_motion_is_no_run(tmp_path: Path) -> None:
    report = examine(open_recording(recorded(tmp_path / "a.mcap", with_steps_of_the_sync)))
    assert (report.session.runs, report.session.unended_runs) == (2, ())


def test_losses_and_origin_are_named(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with Recording(path, provenance=session.provenance(rig_toml="")) as recording:
        for receive_ns, topic, message in healthy():
            recording.write_message(topic, message, receive_ns=receive_ns)
        recording.add_metadata("recorder", {"dropped": "2", "dropped camera/image": "2", "missed": "0"})
    broken = {finding.rule: finding.sentence for finding in findings(examine(open_recording(path)))}
    assert set(broken) == {"dropped", "provenance"}
    assert "2 were dropped (camera/image)" in broken["dropped"]


def test_metadata_that_was_changed_is_named_and_still_read(tmp_path: Path) -> None:
    """One changed letter: MCAP has no checksum for these records, and the rig's name would be another's."""
    path = recorded(tmp_path / "a.mcap", unchanged)
    rig = session.provenance().rig_id.encode()
    content = path.read_bytes()
    assert open_recording(path).changed_metadata == ()
    path.write_bytes(
        content.replace(
            b"rig_id" + len(rig).to_bytes(4, "little") + rig, b"rig_id" + len(rig).to_bytes(4, "little") + rig[::-1]
        )
    )
    reader = open_recording(path)
    assert reader.metadata["session"]["rig_id"] == session.provenance().rig_id[::-1]
    assert reader.changed_metadata == ("session",)
    said = [str(finding) for finding in findings(examine(reader))]
    assert any("metadata 'session' as it was written" in sentence for sentence in said), said


def test_the_figures_are_the_recordings(tmp_path: Path) -> None:
    report = examine(open_recording(recorded(tmp_path / "a.mcap", frames_lost)))
    corners = report.stream("camera/corners")
    assert corners is not None
    assert (corners.count, corners.missing, corners.gaps) == (356, 4, 1)
    assert corners.gap_max_s == pytest.approx(5 / 90, abs=1e-6)
    assert corners.gap_max_at_s == pytest.approx(99 / 90, abs=1e-3)
    assert corners.latency_p50_ms == pytest.approx(session.LATENCY_NS * 1e-6, rel=0.01)
    assert report.arm.commands == 2
    assert report.arm.seen_p50_ms == pytest.approx(10.0, rel=0.01)
    assert (report.session.samples, report.session.kept, report.session.censored) == (2, 1, 1)
    assert report.session.phases["TILT"] == 2


def test_the_rate_asked_for_is_the_rig_files(tmp_path: Path) -> None:
    path = recorded(tmp_path / "a.mcap", thinned("camera/corners", 3), rig_toml="[camera]\nrate_hz = 30.0\n")
    assert "rate" not in rules(path)
    assert "gap" not in rules(path)


def test_frames_recovered_from_before_the_session_are_no_latency(tmp_path: Path) -> None:
    path = recorded(tmp_path / "a.mcap", unchanged, started_ns=session.START_NS + 1_000_000_000)
    corners = examine(open_recording(path)).stream("camera/corners")
    assert corners is not None
    assert corners.history == 90


def run(path: Path, *options: str) -> int:
    parser = argparse.ArgumentParser()
    doctor.add_arguments(parser)
    return doctor.run(parser.parse_args([str(path), *options]))


def test_the_command_prints_and_says_by_its_status(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(recorded(tmp_path / "good.mcap", unchanged), "--digest") == 0
    said = capsys.readouterr().out
    assert "no rule broken" in said
    assert "digest" in said
    assert run(recorded(tmp_path / "bad.mcap", frames_lost)) == 1
    assert "gap: expected /camera/corners without gaps, found 1" in capsys.readouterr().out


def test_json_holds_everything(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(recorded(tmp_path / "a.mcap", frames_lost), "--json") == 1
    values: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert {finding["rule"] for finding in values["findings"]} == {"gap", "missing"}
    assert {stream["topic"] for stream in values["streams"]} >= {"camera/corners", "arm/platform"}


def test_quantiles_are_within_one_percent() -> None:
    values = np.random.default_rng(3).lognormal(15, 2, 5000).astype(int)
    quantiles = Quantiles()
    for value in values.tolist():
        quantiles.add(value)
    for share in (0.1, 0.5, 0.99):
        assert quantiles.at(share) == pytest.approx(float(np.quantile(values, share)), rel=0.015)
