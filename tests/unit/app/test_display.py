"""A terminal, a log and a script each get their own view of a session while it runs."""

from __future__ import annotations

import argparse
import io
import json
import math
import os
import re
import shutil
import struct
import subprocess
import sys
import textwrap
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console

from shared.bus import Received
from shared.messages import (
    AgentStatus,
    ArmLease,
    CameraGeometry,
    ClockOffset,
    MarkerCorners,
    MotionReport,
    PlatformState,
    RunEvent,
    Sample,
    TiltCommand,
)
from station.app.commands import run as command
from station.app.display.choice import display_of
from station.app.display.json_lines import JsonLinesDisplay
from station.app.display.moment import Health
from station.app.display.panel import PanelDisplay, rendered
from station.app.display.plain import PlainDisplay
from station.app.display.watched import SILENT_S, Watched
from station.app.sentences import print_sentence
from station.sampling.plan import Plan
from tests.unit.view import session

PLAN = Plan(samples=4)


class Clock:
    """Seconds that pass when the test says so."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def watched(folder: Path, *, until_s: float, clock: Clock | None = None) -> Watched:
    """The made-up session up to a time."""
    watch = Watched(PLAN, folder / "a.mcap", seconds=clock or Clock())
    for topic, message, stamp_ns in session.session_messages():
        if stamp_ns <= session.START_NS + until_s * 1e9:
            watch.take(Received(topic, stamp_ns, message))
    return watch


def told(watch: Watched, *, height: int = 40, width: int = 100) -> str:
    out = io.StringIO()
    Console(file=out, width=width, height=height).print(rendered(watch.moment()))
    return out.getvalue()


# --- the numbers -----------------------------------------------------------------------------------------------------


def test_the_distance_is_that_of_the_corner_that_decides(tmp_path: Path) -> None:
    before = watched(tmp_path, until_s=session.SLIP_S - 0.2).moment()
    after = watched(tmp_path, until_s=session.SLIP_S + 0.3).moment()
    assert before.phase == "TILT"
    assert before.tilt_deg is not None
    assert before.threshold_px == pytest.approx(10.0 + before.tilt_deg)
    assert before.moved_px is not None
    assert before.moved_px < 1.0
    assert after.moved_px is not None
    assert after.threshold_px is not None
    assert after.moved_px > after.threshold_px


def test_mean_and_sd_are_those_of_the_kept_samples_by_direction(tmp_path: Path) -> None:
    watch = watched(tmp_path, until_s=0.0)
    one = replace(session.sample(), direction=2, onset_angle_rad=0.3, censored=False, flags=())
    left_out = (replace(one, censored=True), replace(one, flags=("turned",)))
    for sample in (one, replace(one, onset_angle_rad=0.4), *left_out):
        watch.take(Received("session/sample", 1, sample))
    moment = watch.moment()
    (found,) = moment.by_direction
    assert (moment.done, found.direction, found.count) == (4, 2, 2)
    assert found.mean_deg == pytest.approx(20.0535, abs=1e-3)
    assert found.sd_deg == pytest.approx(4.0514, abs=1e-3)


def test_a_direction_is_told_with_its_azimuth(tmp_path: Path) -> None:
    watch = Watched(PLAN, tmp_path / "a.mcap", seconds=Clock())
    for sample in (Sample(direction=2, onset_angle_rad=0.3), Sample(direction=-1, onset_angle_rad=0.3)):
        watch.take(Received("session/sample", 1, sample))
    watch.take(Received("arm/tilt_command", 2, TiltCommand(direction=-1, azimuth_rad=math.radians(137), angle_rad=0.1)))
    assert watch.moment().azimuth_deg == pytest.approx(137.0)
    assert {one.direction: one.azimuth_deg for one in watch.moment().by_direction} == {
        -1: None,
        2: pytest.approx(180.0),
    }
    panel = told(watch)
    assert "free (137°)" in panel
    assert "2 (180°)" in panel
    watch.take(Received("session/event", 3, RunEvent(phase="LEVEL")))
    assert (watch.moment().direction, watch.moment().azimuth_deg) == (None, None)


def test_the_time_left_is_that_of_the_samples_so_far(tmp_path: Path) -> None:
    clock = Clock()
    watch = Watched(PLAN, tmp_path / "a.mcap", seconds=clock)
    assert watch.moment().left_s is None
    clock.now += 30.0
    watch.take(Received("session/sample", 1, Sample(direction=0)))
    assert watch.moment().left_s == pytest.approx(90.0)


def test_a_part_that_falls_silent_is_not_well(tmp_path: Path) -> None:
    clock = Clock()
    watch = watched(tmp_path, until_s=2.0, clock=clock)
    watch.take(Received("clock", 1, ClockOffset(agent="camera", offset_ns=1_500_000, sigma_ns=20_000)))
    assert {part.part: part.well for part in watch.moment().health} == dict.fromkeys(
        ("camera", "arm", "clock", "disk"), True
    )
    clock.now += 2.0 * SILENT_S
    watch.take(Received("camera/corners", 1, MarkerCorners()))
    (camera, arm, clocks, _) = watch.moment().health
    assert camera.well
    assert (arm.well, arm.text) == (False, "silent for 4 s")
    assert clocks.text == "camera +1.50 ± 0.02 ms"


def test_a_stopped_arm_is_not_well_however_it_was_stopped(tmp_path: Path) -> None:
    """One that is stopped between two motions has no motion whose end it could report."""
    watch = watched(tmp_path, until_s=1.0)
    watch.take(Received("arm/lease", 1, ArmLease(1, "mine", "by hand")))
    assert (watch.moment().health[1].well, watch.moment().health[1].text) == (False, "stopped (by hand)")
    watch.take(Received("arm/lease", 2, ArmLease(2, "mine")))
    assert watch.moment().health[1].text == "follows"


def test_a_stop_that_is_no_longer_told_is_over(tmp_path: Path) -> None:
    """An arm agent that could not keep the stop is started anew without one, and has no lease to publish."""
    clock = Clock()
    watch = watched(tmp_path, until_s=1.0, clock=clock)
    watch.take(Received("arm/lease", 1, ArmLease(1, "mine", "by hand")))
    clock.now += 2.0 * SILENT_S
    watch.take(Received("arm/platform", 2, PlatformState(qw=1.0)))
    assert watch.moment().health[1].text == "follows"


def test_a_camera_that_loses_frames_is_not_well(tmp_path: Path) -> None:
    def told_of(status: AgentStatus) -> Health:
        watch = Watched(PLAN, tmp_path / "a.mcap", nominal_hz=90.0, seconds=Clock())
        watch.take(Received("camera/corners", 1, MarkerCorners()))
        watch.take(Received("camera/status", 1, status))
        return watch.moment().health[0]

    slow = told_of(AgentStatus(rate_hz=25.2, frames=600, dropped=400))
    assert (slow.well, slow.text) == (False, "only 25.2 of 90 frames/s, 400 dropped (40 %)")
    usual = told_of(AgentStatus(rate_hz=87.2, frames=600, dropped=4))
    assert (usual.well, usual.text) == (True, "87.2 frames/s, 4 dropped")


def test_a_session_that_has_ended_is_none_to_worry_about(tmp_path: Path) -> None:
    clock = Clock()
    watch = watched(tmp_path, until_s=2.0, clock=clock)
    clock.now += 10.0
    camera, arm, *_ = watch.moment().health
    assert (camera.well, arm.well) == (False, False)
    camera, arm, _, disk = watch.moment(ended=True).health
    assert [(part.well, part.off) for part in (camera, arm)] == [(True, True)] * 2
    assert camera.text == "silent, as the session has ended"
    assert disk.text.startswith("no recording in this folder, ")


def test_a_recording_is_looked_for_where_it_may_lie(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_bytes(bytes(2_500_000))
    watch = Watched(PLAN, tmp_path / "recordings" / "a.mcap", elsewhere=(tmp_path,))
    assert watch.moment().health[-1].text.startswith("2.5 MB written, ")


def test_a_folder_that_is_not_there_yet_has_the_room_of_its_disk(tmp_path: Path) -> None:
    disk = Watched(PLAN, tmp_path / "recordings" / "b.mcap").moment().health[-1]
    free_gb = 1e-9 * shutil.disk_usage(tmp_path).free
    told = re.fullmatch(r"no recording in this folder, ([\d.]+) GB free", disk.text)
    assert told
    assert float(told[1]) == pytest.approx(free_gb, abs=1.0)


def test_the_distance_is_told_in_mm_at_the_height_of_the_mark(tmp_path: Path) -> None:
    moment = watched(tmp_path, until_s=session.SLIP_S + 0.3).moment()
    assert moment.moved_px is not None
    assert moment.threshold_px is not None
    nearer = (1 / 6) * (0.3 - 0.01) / 0.3
    assert moment.moved_mm == pytest.approx(nearer * moment.moved_px)
    assert moment.threshold_mm == pytest.approx(nearer * moment.threshold_px)


def test_without_a_geometry_the_distance_is_told_in_pixels(tmp_path: Path) -> None:
    watch = watched(tmp_path, until_s=session.SLIP_S - 0.2)
    watch.take(Received("camera/geometry", 1, CameraGeometry()))
    assert watch.moment().moved_mm is None
    assert "px that make a slip" in told(watch)


def test_messages_that_make_no_sense_are_not_shown(tmp_path: Path) -> None:
    watch = watched(tmp_path, until_s=0.0)
    watch.take(Received("arm/platform", 1, PlatformState(qw=0.0)))
    watch.take(Received("camera/corners", 1, MarkerCorners(found=False)))
    assert (watch.moment().tilt_deg, watch.moment().moved_px) == (None, None)


# --- the panel -------------------------------------------------------------------------------------------------------


def test_the_panel_has_everything_in_the_height_of_a_terminal(tmp_path: Path) -> None:
    watch = watched(tmp_path, until_s=session.SLIP_S - 0.2)
    for number in range(9):
        watch.line("warning", f"line {number}")
    for direction in range(4):
        watch.take(Received("session/sample", 1, replace(session.sample(), direction=direction)))
    panel = told(watch)
    for words in (
        "run 1: TILT",
        "direction",
        "mm that make a slip",
        "4 of 4",
        "24.00",
        "✓ camera",
        "arm",
        "clock",
        "disk",
    ):
        assert words in panel
    assert "warning: line 8" in panel
    assert "line 4" not in panel
    assert panel.count("\n") <= 24


FAULT = (
    "the arm agent does not answer: look at its terminal, press the red button if the plate is tilted, and start it "
    "again with: station arm --rig rig.toml"
)


def test_the_panel_has_a_fault_with_its_remedy_in_whole_words(tmp_path: Path) -> None:
    """An ellipsis hid what to do, which stands at the end."""
    watch = watched(tmp_path, until_s=session.SLIP_S - 0.2)
    for number in range(9):
        watch.line("info", f"line {number}")
    watch.line("error", FAULT)
    watch.take(Received("arm/motion", 1, MotionReport(fault=FAULT)))
    panel = told(watch)
    for words in (*FAULT.split(), "error:", "line 8"):
        assert re.search(rf"\s{re.escape(words)}\s", panel), words
    assert "…" not in panel
    assert " ".join(panel.replace("│", " ").split()).count(FAULT) == 2
    assert panel.count("\n") <= 24


@pytest.mark.parametrize(
    ("height", "width", "has", "lacks"),
    [
        (24, 80, ("samples", "kept samples", "✓ camera", "✓ disk"), ("…",)),
        (14, 80, ("of 4 in", "more rows in a larger terminal"), ("kept samples",)),
        (10, 60, ("more rows in a larger terminal",), ("kept samples", "disk")),
    ],
)
def test_a_low_or_narrow_terminal_has_the_rows_that_matter_most(
    height: int, width: int, has: tuple[str, ...], lacks: tuple[str, ...], tmp_path: Path
) -> None:
    """The fault stood in the rows that a low terminal cut off, and nothing said that there was more."""
    watch = watched(tmp_path, until_s=session.SLIP_S - 0.2)
    for direction in range(4):
        watch.take(Received("session/sample", 1, replace(session.sample(), direction=direction)))
    watch.take(Received("arm/motion", 1, MotionReport(fault=FAULT)))
    tilt, panel = f"{watch.moment().tilt_deg:.2f}°", told(watch, height=height, width=width)
    assert panel.count("\n") <= height
    assert max(map(len, panel.splitlines())) <= width
    for words in ("run 1: TILT", "direction", "0 (0°)", "tilt ", tilt, "! arm", *has):
        assert words in panel, words
    assert FAULT in " ".join(panel.replace("│", " ").split())
    assert not [words for words in lacks if words in panel]


def test_the_smallest_terminal_has_where_the_plate_is_and_as_much_of_the_fault_as_fits(tmp_path: Path) -> None:
    watch = watched(tmp_path, until_s=session.SLIP_S - 0.2)
    watch.take(Received("arm/motion", 1, MotionReport(fault=FAULT)))
    panel = told(watch, height=6, width=40)
    assert panel.count("\n") == 6
    for words in ("run 1: TILT", "direction", "tilt ", "! arm", "more rows"):
        assert words in panel, words


@pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals on Windows")
def test_a_sentence_is_broken_between_words_on_a_terminal_and_nowhere_else(capsys: pytest.CaptureFixture[str]) -> None:
    code = f"from station.app.sentences import print_sentence; print_sentence({FAULT!r})"
    shown = in_terminal([sys.executable, "-c", code], lines=40)
    assert [line.strip() for line in shown.splitlines()] == textwrap.wrap(FAULT, 100)
    print_sentence(FAULT)
    assert capsys.readouterr().out == f"{FAULT}\n"


def test_the_display_follows_from_where_it_is_shown(tmp_path: Path) -> None:
    terminal, pipe = Console(file=io.StringIO(), force_terminal=True), Console(file=io.StringIO())
    path = tmp_path / "a.mcap"
    assert isinstance(display_of(terminal, PLAN, path, json_lines=False), PanelDisplay)
    assert isinstance(display_of(pipe, PLAN, path, json_lines=False), PlainDisplay)
    assert isinstance(display_of(terminal, PLAN, path, json_lines=True), JsonLinesDisplay)


@pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals on Windows")
def test_on_a_terminal_the_panel_is_drawn_in_its_place(tmp_path: Path) -> None:
    """A real session in a pseudo-terminal of 40 lines."""
    words = ["run", "--lockstep", "--samples", "2", "--out", str(tmp_path / "a.mcap")]
    printed = in_terminal([sys.executable, "-m", "station", *words], lines=40)
    drawings = printed.split("╭─ run ")
    assert len(drawings) > 2
    # Every drawing but the first begins with the way up to where the one before it began.
    for before, here in zip(drawings[1:-1], drawings[1:], strict=False):
        lines = before.split("╯")[0].count("\n")
        assert len(re.findall(r"\x1b\[1A", before.split("╯")[1])) == lines, here
    last = drawings[-1]
    assert "2 of 2" in last
    assert "✓ camera" in last
    assert "Recording: " in last


def in_terminal(words: list[str], *, lines: int) -> str:
    """Returns what a program prints in a pseudo-terminal of 100 columns."""
    import fcntl  # noqa: PLC0415  # not on Windows
    import pty  # noqa: PLC0415
    import termios  # noqa: PLC0415

    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", lines, 100, 0, 0))
    # The terminal's own size counts, and not that of the one in which the tests were begun.
    environment = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "LINES")}
    environment |= {"TERM": "xterm-256color"}
    program = subprocess.Popen(words, stdin=theirs, stdout=theirs, stderr=theirs, env=environment)
    os.close(theirs)
    printed = bytearray()
    while True:
        try:
            printed += os.read(ours, 65536)
        except OSError:  # the program has ended
            break
    os.close(ours)
    assert program.wait() == 0
    return printed.decode(errors="replace").replace("\r", "")


# --- lines -----------------------------------------------------------------------------------------------------------


def test_a_script_gets_one_object_a_line_and_nothing_else(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    parser = argparse.ArgumentParser()
    command.add_arguments(parser)
    out = tmp_path / "a.mcap"
    words = ["--lockstep", "--samples", "2", "--seed", "1", "--json-lines", "--out", str(out)]
    assert command.run(parser.parse_args(words)) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    (note,) = lines[0].pop("notes")
    assert "its camera sags" in note
    assert lines[0] == {"event": "start", "recording": str(out), "total": 2}
    assert lines[-1] == {"event": "end", "recording": str(out), "samples": 2, "fault": ""}
    phases = [line["phase"] for line in lines if line["event"] == "phase" and line["run"] == 1]
    assert phases == ["LEVEL", "DWELL", "REFERENCE", "TILT", "SLIP", "SETTLE", "RETURN", "DONE"]
    samples = [line for line in lines if line["event"] == "sample"]
    assert [line["run"] for line in samples] == [1, 2]
    assert all(5.0 < line["onset_deg"] < 60.0 for line in samples)


def test_a_script_gets_the_status_once_a_second(tmp_path: Path) -> None:
    clock, out = Clock(), io.StringIO()
    watch = watched(tmp_path, until_s=2.0, clock=clock)
    display = JsonLinesDisplay(out, watch, path=tmp_path / "a.mcap", total=4, seconds=clock)
    for _ in range(5):
        clock.now += 0.5
        display.tell(0)
    found = [json.loads(line) for line in out.getvalue().splitlines()]
    assert [line["event"] for line in found] == ["status", "status"]
    assert found[0]["health"][0]["part"] == "camera"
    assert found[0]["tilt_deg"] > 0


def test_a_log_gets_plain_lines(tmp_path: Path) -> None:
    out = io.StringIO()
    with display_of(Console(file=out, width=80), PLAN, tmp_path / "a.mcap", json_lines=False) as display:
        display.line("warning", "the mark [is] lost")
        display.tell(1)
    assert out.getvalue() == "warning the mark [is] lost\n"


@pytest.mark.timeout(10)
def test_a_log_gets_a_long_line_in_no_time(tmp_path: Path) -> None:
    """Whoever is on the bus may send it; to highlight so long a word took minutes."""
    out = io.StringIO()
    with display_of(Console(file=out, width=80), PLAN, tmp_path / "a.mcap", json_lines=False) as display:
        display.line("error", "z" * 200_000)
    assert out.getvalue().count("z") == 200_000
