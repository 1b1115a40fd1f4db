"""A session on real processes goes on, or ends in words, when one of them is killed."""

from __future__ import annotations

import re
import signal
import time

import pytest

from station.__main__ import main
from station.recording.reader import open_recording
from tests.system.live_rig import Rig, decided_the_same, events_of, samples_of, tilt_of

pytestmark = pytest.mark.system


def test_a_killed_station_leaves_a_level_plate_a_whole_recording_and_a_rig_that_goes_on(rig: Rig):
    path = rig.session("first.mcap")
    partial = path.with_name(path.name + ".partial")
    rig.wait("a tilted plate", rig.tilting)
    killed_ns = time.time_ns()
    rig.kill("run")
    rig.wait("the plate to be level", lambda: rig.tilt_rad() < 0.002)
    held = [tilt_of(item.message) for item in rig.listen("arm/platform") if item.receive_ns > killed_ns + 3_000_000_000]
    assert max(held) > 0.1, "it holds for some seconds before it levels"
    said = " ".join(str(message) for message in rig.messages("log"))
    assert "heartbeat is lost: levelling slowly" in said
    assert partial.exists()
    assert not path.exists()

    rig.session("second.mcap", samples=1)
    status, printed = rig.ended()
    assert status == 0, printed
    assert "A session before this one was cut off" in printed
    first, second = open_recording(path), open_recording(rig.folder / "second.mcap")
    assert not partial.exists()
    last_ns = max(item.log_ns for item in first.messages({"arm/platform"}))
    assert killed_ns - last_ns <= 500_000_000
    assert "TILT" in {event.phase for event in events_of(first)}
    assert len(samples_of(second)) == 1
    assert decided_the_same(path)
    assert decided_the_same(rig.folder / "second.mcap")


def test_a_killed_camera_aborts_the_run_in_words_and_a_new_one_lets_the_session_go_on(rig: Rig):
    path = rig.session("camera.mcap", samples=1, faults=1)
    rig.wait("a tilted plate", rig.tilting)
    rig.kill("camera")
    rig.wait("the run to be aborted", rig.aborted)
    rig.start("camera")
    status, printed = rig.ended()
    assert status == 0, printed
    aborted = [event.reason for event in events_of(open_recording(path)) if event.phase == "ABORTED"]
    assert re.search("expected corners of the marker, got none for 1 s", aborted[0])
    assert "pi-agent" in " ".join(aborted) + printed
    assert len(samples_of(open_recording(path))) == 1
    assert decided_the_same(path)


def test_a_killed_arm_agent_is_named_and_a_new_one_levels_first_and_goes_on(rig: Rig):
    path = rig.session("arm.mcap", samples=1, faults=1)
    rig.wait("a tilted plate", rig.tilting)
    rig.kill("arm")
    rig.wait("the run to be aborted", rig.aborted)
    rig.start("arm")
    status, printed = rig.ended()
    assert status == 0, printed
    events = events_of(open_recording(path))
    first = next(k for k, event in enumerate(events) if event.phase == "ABORTED")
    assert re.search("arm agent.*station arm", events[first].reason), events[first].reason
    assert "LEVEL" in {event.phase for event in events[first:]}
    assert len(samples_of(open_recording(path))) == 1
    assert decided_the_same(path)


def test_a_stop_that_the_session_could_not_hear_outlives_the_arm_agent_and_ends_that_session_alone(rig: Rig):
    path = rig.session("stopped.mcap", dwell_s=20.0)
    rig.wait("a dwell", lambda: bool(rig.phases()) and rig.phases()[-1][1] == "DWELL")
    station = rig.processes["run"]
    station.send_signal(signal.SIGSTOP)
    try:
        assert main(["arm", "stop", "--rig", str(rig.file), "--reason", "a hand in the rig"]) == 0
        rig.kill("arm")
        rig.wait("the arm agent to be gone", lambda: "arm" not in rig.bus.alive(), running="")
        rig.start("arm")
        rig.wait("a new arm agent", lambda: "arm" in rig.bus.alive(), running="")
        again_ns = time.time_ns()
    finally:
        station.send_signal(signal.SIGCONT)
    status, printed = rig.ended()
    assert status == 1
    assert "the arm is stopped (a hand in the rig)" in " ".join(printed.split())
    rig.wait("an attitude", lambda: rig.listen("arm/platform")[-1].receive_ns > again_ns, running="")
    assert rig.tilt_rad() < 0.002
    assert not rig.messages("arm/motion", since_ns=again_ns)
    assert decided_the_same(path)

    path = rig.session("next.mcap", samples=1)
    status, printed = rig.ended()
    assert status == 0, printed
    assert len(samples_of(open_recording(path))) == 1


def test_an_arm_agent_that_stays_away_ends_the_session_in_words(rig: Rig):
    path = rig.session("gone.mcap", faults=2, outage_s=5.0)
    rig.wait("a tilted plate", rig.tilting)
    rig.kill("arm")
    status, printed = rig.ended()
    assert status == 1
    assert re.search(r"The session ended early: .*arm agent.*station arm", printed, re.DOTALL), printed
    assert "Traceback" not in printed
    aborted = {event.run for event in events_of(open_recording(path)) if event.phase == "ABORTED"}
    assert aborted
    assert aborted.isdisjoint(sample.run for sample in samples_of(open_recording(path)))
    assert decided_the_same(path)


def test_a_killed_twin_ends_the_session_in_words(rig: Rig):
    path = rig.session("twin.mcap", faults=2, outage_s=5.0)
    rig.wait("a tilted plate", rig.tilting)
    rig.kill("twin")
    status, printed = rig.ended()
    assert status == 1
    assert re.search(r"The session ended early: .*(no longer reports|does not report) its joints", printed, re.DOTALL)
    assert "Traceback" not in printed
    assert "ABORTED" in {event.phase for event in events_of(open_recording(path))}
    assert decided_the_same(path)
