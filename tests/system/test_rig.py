"""The whole rig as a user starts it: real processes, real sockets, and what happens when one of them is missing."""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from shared.geometry import tilt_of
from shared.messages import AgentStatus, MarkerCorners, Message, PlatformState, RunEvent
from station.__main__ import main
from station.recording.reader import open_recording
from tests.patience import PATIENCE_S
from tests.system.processes import CALM_HZ, LEVEL_RAD, ROOT, end, observer, rig_file, running, start, wait, wait_for

pytestmark = pytest.mark.system


def station(*words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "station", *words]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=PATIENCE_S, check=False)


def tilt(message: Message) -> float:
    """The plate's tilt (rad) in a message of arm/platform."""
    assert isinstance(message, PlatformState)
    return tilt_of(message.qw, message.qx, message.qy, message.qz)


def test_one_command_runs_the_rig_end_to_end(tmp_path: Path):
    rig, out, plan = rig_file(tmp_path), tmp_path / "session.mcap", tmp_path / "plan.toml"
    plan.write_text("[tilt]\nsteps = 20\nrate_deg_s = 10.0\n", encoding="utf-8")
    words = ("--rig", str(rig), "--plan", str(plan), "--samples", "2", "--no-view", "--out", str(out))
    done = station("rig", *words)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"station replay {out}" in done.stdout
    reader = open_recording(out)
    assert [sample.run for sample in reader.samples()][-1] >= 2
    # A frame that a busy machine takes late may disturb a run, which then does not count.
    assert len([sample for sample in reader.samples() if not sample.disturbed]) == 2
    # A busy machine may cost the synthetic camera frames, which the agent counts; none is lost after it was tracked.
    # It counts a frame some time after the frame was due: the last report knows all of those before the one before it.
    counts = [item.message for item in reader.messages({"camera/status"}) if isinstance(item.message, AgentStatus)]
    corners = [item.message for item in reader.messages({"camera/corners"}) if isinstance(item.message, MarkerCorners)]
    seqs = [message.seq for message in corners if message.capture_ns <= counts[-2].stamp_ns]
    assert seqs == sorted(set(seqs))
    assert seqs[-1] - seqs[0] + 1 - len(seqs) <= counts[-1].dropped
    assert station("check", str(out)).returncode == 0
    wanted = {"/camera/image", "/camera/plate", "/arm/joints", "/arm/platform", "/tf", "/log", "/clock"}
    assert wanted <= {f"/{name}" for name in reader.topics}


def ended(process: subprocess.Popen[str]) -> str:
    """Returns what a process printed until it ended by itself; one that does not is not left to later tests."""
    try:
        return process.communicate(timeout=PATIENCE_S)[0]
    except subprocess.TimeoutExpired:
        process.kill()
        print(process.communicate()[0])
        raise


def test_ctrl_c_levels_the_plate_closes_the_recording_and_stops_everybody(tmp_path: Path):
    rig, out = rig_file(tmp_path, rate_hz=CALM_HZ), tmp_path / "session.mcap"
    words = ("rig", "--rig", str(rig), "--samples", "50", "--no-view", "--out", str(out))
    process = start("station", *words)
    partial = out.with_name(out.name + ".partial")
    tilts: list[float] = [0.0]
    with observer(rig) as bus:
        bus.subscribe("arm/platform", lambda received: tilts.append(tilt(received.message)))
        wait(bus, lambda: tilts[-1] > 0.06 or process.poll() is not None)
    assert partial.exists()
    process.send_signal(signal.SIGINT)
    printed = ended(process)
    assert "stopped by the user" in printed
    assert not partial.exists()
    attitudes = [item.message for item in open_recording(out).messages({"arm/platform"})]
    recorded = [tilt(message) for message in attitudes]
    assert max(recorded) > 0.05
    assert recorded[-1] < LEVEL_RAD
    events = [item.message for item in open_recording(out).messages({"session/event"})]
    phases = [event.phase for event in events if isinstance(event, RunEvent)]
    assert "ABORTED" in phases
    assert station("check", str(out)).returncode == 0, "a session that Ctrl-C ends decides what its recording says"
    left = subprocess.run(["pgrep", "-f", str(rig)], capture_output=True, text=True, check=False).stdout.split()
    assert left == []


def test_a_station_that_is_killed_is_told_with_what_saves_its_recording(tmp_path: Path):
    rig, out = rig_file(tmp_path, rate_hz=CALM_HZ), tmp_path / "session.mcap"
    process = start("station", "rig", "--rig", str(rig), "--samples", "50", "--no-view", "--out", str(out))
    partial = out.with_name(out.name + ".partial")
    with observer(rig) as bus:
        wait(bus, lambda: partial.exists() or process.poll() is not None)
    found = subprocess.run(["pgrep", "-f", f"station run --rig {rig}"], capture_output=True, text=True, check=True)
    os.kill(int(found.stdout), signal.SIGKILL)
    printed = ended(process)
    assert process.returncode == 1
    assert f"repair {partial}" in printed
    assert station("repair", str(partial)).returncode == 0
    assert out.exists()
    assert station("check", str(out)).returncode == 0


def test_ctrl_c_ends_a_session_in_simulated_time_with_its_table(tmp_path: Path):
    out = tmp_path / "session.mcap"
    process = start("station", "run", "--lockstep", "--samples", "9999", "--seed", "1", "--out", str(out))
    assert process.stdout is not None
    while "samples in" not in process.stdout.readline():  # it says how far it is every ten seconds
        assert process.poll() is None
    process.send_signal(signal.SIGINT)
    printed = ended(process)
    assert process.returncode == 1
    assert "stopped by the user" in printed
    assert f"replay {out}" in printed
    assert open_recording(out).samples()
    assert station("check", str(out)).returncode == 0


@pytest.mark.parametrize("missing", ["camera", "arm", "twin"])
def test_whoever_is_missing_is_named_with_what_to_start(tmp_path: Path, missing: str):
    rig = rig_file(tmp_path, rate_hz=CALM_HZ)
    others = {"camera": ("pi_agent", "run"), "arm": ("station", "arm"), "twin": ("station", "twin")}
    processes = [start(*words, "--rig", str(rig)) for name, words in others.items() if name != missing]
    try:
        wait_for(rig, set(others) - {missing})
        done = station("run", "--rig", str(rig), "--samples", "1", "--out", str(tmp_path / "x.mcap"))
    finally:
        print(*(end(process) for process in processes))
    assert done.returncode == 2
    assert re.search(rf"no {missing} on the bus of rig .*: start (pi-agent|station)", done.stderr), done.stderr
    assert "Traceback" not in done.stderr
    assert not list(tmp_path.glob("x.mcap*"))


def test_two_rigs_on_one_machine_do_not_hear_each_other(tmp_path: Path):
    one, other = rig_file(tmp_path, name="one"), rig_file(tmp_path, name="other")
    with running("station", "twin", "--rig", str(one)), running("station", "arm", "--rig", str(one)):
        wait_for(one, {"twin", "arm"})
        done = station("run", "--rig", str(other), "--samples", "1", "--out", str(tmp_path / "x.mcap"))
    assert done.returncode == 2
    for name in ("camera", "arm", "twin"):
        assert f"no {name} on the bus" in done.stderr


@pytest.mark.parametrize(
    ("extra", "said"),
    [
        ("\n[camera.lens]\nf = 1\n", "line .*'camera.lens'.*unknown key"),
        ("\n[plat]\nside_m = 0.1\n", "line .*'plat'.*unknown key"),
    ],
)
def test_an_unknown_key_in_the_rig_file_is_named_with_its_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], extra: str, said: str
):
    assert main(["run", "--lockstep", "--rig", str(rig_file(tmp_path, extra=extra)), "--samples", "1"]) == 2
    printed = capsys.readouterr().err
    assert re.search(said, printed), printed


@pytest.mark.parametrize(
    ("plan", "said"),
    [
        ("samples = 3\n[tilt]\nsteps = 'many'\n", r"line 3.*a whole number.*'tilt.steps'.*'many'"),
        ("sample = 3\n", r"line 1.*'sample'.*unknown key"),
        ("[slip]\ncorners = 7\n", r"\[slip\].*1 <= corners <= 4"),
        ("samples = [", "expected TOML"),
    ],
)
def test_a_mistake_in_a_plan_is_named_with_its_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], plan: str, said: str
):
    file = tmp_path / "plan.toml"
    file.write_text(plan, encoding="utf-8")
    assert main(["run", "--lockstep", "--plan", str(file), "--out", str(tmp_path / "x.mcap")]) == 2
    printed = capsys.readouterr().err
    assert re.search(said, printed), printed
