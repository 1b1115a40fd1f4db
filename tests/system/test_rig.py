"""The whole rig as a user starts it: real processes, real sockets, and what happens when one of them is missing."""

import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from shared.geometry import tilt_of
from shared.messages import AgentStatus, MarkerCorners, PlatformState, RunEvent
from station.recording.reader import open_recording
from tests.system.processes import ROOT, end, rig_file, running, start

pytestmark = [pytest.mark.system, pytest.mark.timeout(240)]


def station(*words: str, timeout_s: float = 60.0) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "station", *words]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=timeout_s, check=False)


def test_one_command_runs_the_rig_end_to_end(tmp_path: Path):
    rig, out = rig_file(tmp_path), tmp_path / "session.mcap"
    done = station("rig", "--rig", str(rig), "--samples", "2", "--no-view", "--out", str(out), timeout_s=200)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"station replay {out}" in done.stdout
    reader = open_recording(out)
    assert [sample.run for sample in reader.samples()][-1] >= 2
    assert len(reader.samples()) == 2
    corners = [item.message for item in reader.messages({"camera/corners"})]
    seqs = [message.seq for message in corners if isinstance(message, MarkerCorners)]
    # A busy machine may cost the synthetic camera frames, which the agent counts; none is lost after it was tracked.
    status = [item.message for item in reader.messages({"camera/status"})]
    dropped = max(message.dropped for message in status if isinstance(message, AgentStatus))
    assert seqs == sorted(set(seqs))
    assert seqs[-1] - seqs[0] + 1 - len(seqs) <= dropped
    assert station("check", str(out)).returncode == 0
    wanted = {"/camera/image", "/camera/plate", "/arm/joints", "/arm/platform", "/tf", "/log", "/clock"}
    assert wanted <= {f"/{name}" for name in reader.topics}


def test_ctrl_c_levels_the_plate_closes_the_recording_and_stops_everybody(tmp_path: Path):
    rig, out = rig_file(tmp_path), tmp_path / "session.mcap"
    words = ("rig", "--rig", str(rig), "--samples", "50", "--no-view", "--out", str(out))
    process = start("station", *words)
    partial = out.with_name(out.name + ".partial")
    begin = time.monotonic()
    while time.monotonic() - begin < 60 and not (partial.exists() and time.monotonic() - begin > 15):
        time.sleep(0.2)
        assert process.poll() is None
    process.send_signal(signal.SIGINT)
    printed = process.communicate(timeout=40)[0]
    assert "stopped by the user" in printed
    assert not partial.exists()
    attitudes = [item.message for item in open_recording(out).messages({"arm/platform"})]
    tilts = [tilt_of(a.qw, a.qx, a.qy, a.qz) for a in attitudes if isinstance(a, PlatformState)]
    assert max(tilts) > 0.05
    assert tilts[-1] < 0.001
    events = [item.message for item in open_recording(out).messages({"session/event"})]
    phases = [event.phase for event in events if isinstance(event, RunEvent)]
    assert "ABORTED" in phases
    left = subprocess.run(["pgrep", "-f", str(rig)], capture_output=True, text=True, check=False).stdout.split()
    assert left == []


@pytest.mark.parametrize("missing", ["camera", "arm", "twin"])
def test_whoever_is_missing_is_named_with_what_to_start(tmp_path: Path, missing: str):
    rig = rig_file(tmp_path)
    others = {"camera": ("pi_agent", "run"), "arm": ("station", "arm"), "twin": ("station", "twin")}
    processes = [start(*words, "--rig", str(rig)) for name, words in others.items() if name != missing]
    try:
        time.sleep(4.0)
        done = station("run", "--rig", str(rig), "--samples", "1", "--out", str(tmp_path / "x.mcap"))
    finally:
        for process in processes:
            end(process)
    assert done.returncode == 2
    assert re.search(rf"no {missing} on the bus of rig .*: start (pi-agent|station)", done.stderr), done.stderr
    assert "Traceback" not in done.stderr
    assert not list(tmp_path.glob("x.mcap*"))


def test_two_rigs_on_one_machine_do_not_hear_each_other(tmp_path: Path):
    one, other = rig_file(tmp_path, name="one"), rig_file(tmp_path, name="other")
    with running("station", "twin", "--rig", str(one)), running("station", "arm", "--rig", str(one)):
        time.sleep(3.0)
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
def test_an_unknown_key_in_the_rig_file_is_named_with_its_line(tmp_path: Path, extra: str, said: str):
    done = station("run", "--lockstep", "--rig", str(rig_file(tmp_path, extra=extra)), "--samples", "1")
    assert done.returncode == 2
    assert re.search(said, done.stderr), done.stderr


@pytest.mark.parametrize(
    ("plan", "said"),
    [
        ("samples = 3\n[tilt]\nsteps = 'many'\n", r"line 3.*a whole number.*'tilt.steps'.*'many'"),
        ("sample = 3\n", r"line 1.*'sample'.*unknown key"),
        ("[slip]\ncorners = 7\n", r"\[slip\].*1 <= corners <= 4"),
        ("samples = [", "expected TOML"),
    ],
)
def test_a_mistake_in_a_plan_is_named_with_its_line(tmp_path: Path, plan: str, said: str):
    file = tmp_path / "plan.toml"
    file.write_text(plan, encoding="utf-8")
    done = station("run", "--lockstep", "--plan", str(file), "--out", str(tmp_path / "x.mcap"))
    assert done.returncode == 2
    assert re.search(said, done.stderr), done.stderr
    assert "Traceback" not in done.stderr
