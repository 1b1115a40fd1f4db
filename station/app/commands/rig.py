"""Starts the whole simulated rig and runs a session on it.

Twin, arm agent, camera agent and station are separate processes on the real bus; at the end, or at Ctrl-C, all are
stopped, and the table of samples and the way to look at the recording are printed.
"""

from __future__ import annotations

import argparse
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import FrameType

from shared.arguments import seed_of
from shared.bus_rights import OBSERVER
from shared.errors import UserError
from shared.programs import how_to_call
from shared.rig import RigConfig
from shared.system.desktop import from_here, has_display
from shared.system.processes import ENDING, ask_to_end, interrupt, start
from shared.system.signals import handling
from shared.zenoh_bus import ZenohBus
from station.app import assembly, recordings
from station.recording.writer import partial_path, refuse_existing

NAME = "rig"
HELP = "the whole simulated rig from one command"
EXAMPLE = "station rig --samples 5"
ONE = "the session ended before its plan was carried out; the recording is whole"
STOPPED = "1 once the session has begun"
HELPERS = frozenset({"camera", "arm", "twin"})
_START_S = 60.0
"""Helpers come up within 2 s, and on a machine that does ten things besides not within 4 s
(`make test-portable ARGS="--variant load tests/system/test_rig.py"`)."""
_GRACE_S = 10.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument("--rig", help="rig file; without it the simulated rig that comes with Repose")
    parser.add_argument("--plan", help="plan file; without it every constant has the paper's value")
    parser.add_argument("--samples", type=int, default=5, help="how many runs")
    parser.add_argument("--seed", type=seed_of, default=1, help="seed of twin and session")
    parser.add_argument("--out", help="the recording; without it recordings/<time>.mcap")
    parser.add_argument("--no-view", action="store_true", help="do not open the Rerun viewer")


def run(options: argparse.Namespace) -> int:
    """Gives the session's exit status."""
    rig_path = options.rig or str(assembly.simulated_rig_path())
    # A mistake in what was asked for is named before anything starts.
    rig = assembly.rig_from(rig_path)
    assembly.plan_from(options.plan, samples=options.samples, seed=options.seed)
    out = recordings.recording_path(options.out)
    refuse_existing(out)
    plan = ["--plan", options.plan] if options.plan else []
    print(f"Starting the simulated rig '{rig.id}': twin, arm agent, camera agent, station.", flush=True)
    helpers = [
        _start("pi_agent", "run", "--rig", rig_path),
        _start("station", "arm", "--rig", rig_path),
        _start("station", "twin", "--rig", rig_path, "--seed", str(options.seed)),
    ]
    session: subprocess.Popen[bytes] | None = None
    view = _view(rig_path, wanted=not options.no_view)
    # Also where it was started in the background, which has Ctrl-C ignored, and for `kill`: nobody is left behind.
    with handling(_interrupted):
        try:
            await_helpers(rig, helpers)
            words = ["--samples", str(options.samples), "--seed", str(options.seed), "--out", str(out)]
            session = _start("station", "run", "--rig", rig_path, *words, *plan)
            _watch(session, helpers)
            return _ending(session, out)
        except KeyboardInterrupt:
            return 130
        finally:
            for number in ENDING:  # the second of two signals would leave somebody behind
                signal.signal(number, signal.SIG_IGN)
            _stop([process for process in (session, view, *helpers) if process is not None])


def _interrupted(_number: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt


def _view(rig_path: str, *, wanted: bool) -> subprocess.Popen[bytes] | None:
    """Returns the live view as a process of its own, so that drawing never delays the station."""
    if wanted and has_display():
        return _start("station", "replay", "--live", "--rig", rig_path)
    print(f"To watch it live: {how_to_call('station')} replay --live --rig {from_here(Path(rig_path))}", flush=True)
    return None


def _start(module: str, *words: str) -> subprocess.Popen[bytes]:
    """Starts one process of the rig; Ctrl-C comes to it from here and in order."""
    return start([sys.executable, "-m", module, *words])


def await_helpers(rig: RigConfig, helpers: list[subprocess.Popen[bytes]]) -> None:
    """Waits until the helpers are on the bus; `station run` itself says who is missing after that."""
    end = time.monotonic() + _START_S
    with ZenohBus.of(OBSERVER, rig) as bus:
        while not bus.alive() >= HELPERS and time.monotonic() < end:
            _require_running(helpers)
            bus.poll(0.05)


def _require_running(helpers: list[subprocess.Popen[bytes]]) -> None:
    for process in helpers:
        if process.poll() is not None:
            raise UserError(
                f"`{_words(process)}` ended by itself with status {process.returncode}; its reason is above"
            )


def _watch(session: subprocess.Popen[bytes], helpers: list[subprocess.Popen[bytes]]) -> None:
    """Returns when the session has ended."""
    while session.poll() is None:
        try:
            _require_running(helpers)
            time.sleep(0.1)
        except KeyboardInterrupt:
            print("Stopping: the plate goes back to level first (Ctrl-C again: at once).", flush=True)
            interrupt(session)


def _ending(session: subprocess.Popen[bytes], out: Path) -> int:
    """Returns the session's exit status; one that was killed could not say itself what is left of it."""
    status = int(session.returncode)
    if status >= 0:
        return status
    by, partial = signal.Signals(-status).name, partial_path(out)
    print(
        f"The session was killed ({by}). Save what it recorded: {how_to_call('station')} repair {partial}", flush=True
    )
    return 1


def _stop(processes: list[subprocess.Popen[bytes]]) -> None:
    """Ends them one after another: politely, and after a grace for good."""
    for process in processes:
        if process.poll() is None:
            ask_to_end(process)
            try:
                process.wait(_GRACE_S)
            except subprocess.TimeoutExpired:
                print(f"`{_words(process)}` did not end within {_GRACE_S:g} s and was killed", file=sys.stderr)
                process.kill()
                process.wait()


def _words(process: subprocess.Popen[bytes]) -> str:
    words = process.args if isinstance(process.args, list) else [str(process.args)]
    return " ".join(Path(str(word)).name for word in words[2:])
