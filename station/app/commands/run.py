"""Runs a session: tilts the plate until the block slides, again and again, and records everything to one MCAP file.

Live, it expects the camera agent, the arm agent (and the twin, on the simulated rig) on the bus; `station rig` starts
them all. With --lockstep the same state machine, twin and recorder run in simulated time in this one process; a second
processor, where there is one, writes the file.
"""

from __future__ import annotations

import argparse
import atexit
import gc
import sys
import time
from contextlib import ExitStack
from pathlib import Path

from rich.console import Console

from shared.arguments import seed_of
from shared.clock import SIMULATION_EPOCH_NS, SystemClock
from shared.errors import UserError
from shared.installed import missing_as_user_error
from shared.rig import RigConfig
from station.app import assembly, recordings
from station.app.attached import planted_in
from station.app.claim import claim_arm, session_name
from station.app.display.choice import Display, display_of
from station.app.lockstep import Lockstep
from station.app.notify.telling import telling
from station.app.pixels import pixel_camera
from station.app.processes import stop_by_signal
from station.app.sentences import print_sentence
from station.app.signature import keys_folder, signature_path
from station.app.summary import print_summary
from station.arm.tilter import Tilter
from station.recording.repair import repair_folder
from station.recording.writer import Recording
from station.recording.writer_process import WriterProcess, can_start_writer_process
from station.sampling.plan import Plan

NAME = "run"
HELP = "run a session and record it"
EXAMPLE = "station run --lockstep --samples 500 --seed 1 --out sim.mcap"
ONE = "the session ended before its plan was carried out; the recording is whole"
STOPPED = "1 once the session has begun"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument("--rig", help="rig file; without it the simulated rig that comes with Repose")
    parser.add_argument("--plan", help="plan file; without it every constant has the paper's value")
    parser.add_argument("--samples", type=int, help="how many runs (replaces the plan's)")
    parser.add_argument("--seed", type=seed_of, help="seed of every random choice (replaces the plan's)")
    parser.add_argument("--out", help="the recording; without it recordings/<time>.mcap")
    parser.add_argument("--overwrite", action="store_true", help="replace a recording of that name")
    recordings.add_split(parser)
    parser.add_argument("--take-over", action="store_true", help="take the arm over from a session that has it")
    parser.add_argument("--lockstep", action="store_true", help="simulated time, one process, faster than life")
    parser.add_argument("--pixels", action="store_true", help="with --lockstep: render frames and track them")
    parser.add_argument("--json-lines", action="store_true", help="for scripts: one JSON object a line, nothing else")


def run(options: argparse.Namespace) -> int:
    """Runs the session; 0 when the plan was carried out, 1 when it had to stop early."""
    rig = assembly.rig_from(options.rig)
    plan = assembly.plan_from(options.plan, samples=options.samples, seed=options.seed)
    if options.pixels and not options.lockstep:
        raise UserError("Expected --lockstep with --pixels; a live session has the pixels of its own camera")
    tilter = assembly.require_reachable(rig, plan)
    path = recordings.recording_path(options.out)
    for repaired in repair_folder(path.parent):
        where = sys.stderr if options.json_lines else sys.stdout
        print(f"A session before this one was cut off; what it recorded is saved as {repaired.path}", file=where)
    return _lockstep(options, rig, plan, path, tilter) if options.lockstep else _live(options, rig, plan, path)


def _display(console: Console, rig: RigConfig, plan: Plan, path: Path, *, json_lines: bool) -> Display:
    notes = planted_in(rig)
    return display_of(console, plan, path, json_lines=json_lines, nominal_hz=rig.camera.rate_hz, notes=notes)


def _lockstep(options: argparse.Namespace, rig: RigConfig, plan: Plan, path: Path, tilter: Tilter) -> int:
    # Leaving, the interpreter would search all that it has loaded for cycles: a tenth of a second for nothing.
    atexit.register(gc.freeze)
    console = Console(stderr=True, highlight=False)
    origin = recordings.provenance(rig, plan, mode="lockstep", started_ns=SIMULATION_EPOCH_NS)
    begin = time.perf_counter()
    with ExitStack() as stack:
        recording = Recording(
            path, provenance=origin, overwrite=options.overwrite, split_bytes=options.split, flush_every_s=10.0
        )
        recording = WriterProcess(recording) if can_start_writer_process() else recording
        stack.callback(recording.close)
        display = stack.enter_context(_display(console, rig, plan, path, json_lines=options.json_lines))
        lockstep = Lockstep(
            rig,
            plan,
            recording=recording,
            camera=pixel_camera(plan.seed) if options.pixels else None,
            on_line=display.line,
            tilter=tilter,
        )
        display.attach(lockstep.bus)
        stop = stack.enter_context(stop_by_signal())
        watch = stack.enter_context(telling(rig, plan, path, where=console))
        outcome = lockstep.run(on_sample=display.tell, stop=stop)
        recording.close()
        if recording.stopped:
            watch.stopped_recording(recording.stopped)
        fault = outcome.fault or recording.stopped
        watch.ended(fault, samples=outcome.samples)
    wall = time.perf_counter() - begin
    console.print(
        f"{outcome.samples} samples, {outcome.simulated_s:.1f} s of the rig's time in {wall:.1f} s: "
        f"{outcome.simulated_s / wall:.3g} times faster than life."
    )
    return _close(recording.path, fault, display, json_lines=options.json_lines)


def _live(options: argparse.Namespace, rig: RigConfig, plan: Plan, path: Path) -> int:
    # A simulated session needs no network.
    from shared.zenoh_bus import ZenohBus  # noqa: PLC0415
    from station.app.live import LiveSession, await_processes  # noqa: PLC0415

    console = Console(stderr=True, highlight=False)
    clock = SystemClock()
    with ExitStack() as stack:
        stop = stack.enter_context(stop_by_signal())
        watch = stack.enter_context(telling(rig, plan, path, where=console))  # left after arm and bus are let go
        bus = ZenohBus.of("station", rig, clock=clock)
        stack.callback(bus.close)
        bus.announce("station")
        await_processes(bus, rig)
        owner = session_name()
        claim_arm(bus, clock=clock, owner=owner, take_over=options.take_over)
        origin = recordings.provenance(rig, plan, mode="live", started_ns=clock.now_ns())
        recording = Recording(path, provenance=origin, overwrite=options.overwrite, split_bytes=options.split)
        display = stack.enter_context(_display(console, rig, plan, path, json_lines=options.json_lines))
        session = LiveSession(
            bus,
            rig,
            plan,
            recording=recording,
            clock=clock,
            stop=stop,
            on_line=display.line,
            owner=owner,
            watch=watch,
        )
        display.attach(bus)
        fault = session.run(on_tick=lambda: display.tell(session.samples))
        watch.ended(fault, samples=session.samples)
    status = _close(recording.path, fault, display, json_lines=options.json_lines)
    sign_session(recording.path, where=console)
    return status


def sign_session(path: Path, *, where: Console) -> None:
    """Signs the recording of a session on a rig with keys; a session is not lost because its keys are not in order."""
    signature_path(path).unlink(missing_ok=True)  # a signature of the recording that this one replaces
    keys = keys_folder(None)
    if keys is None or not path.exists():
        return
    try:
        with missing_as_user_error():
            from station.app.signing import sign  # noqa: PLC0415

            where.print(f"Signed: {sign(path, keys, now_ns=time.time_ns())}", markup=False)
    except UserError as error:
        where.print(f"The recording is not signed: {error}", markup=False)


def _close(path: Path, fault: str, display: Display, *, json_lines: bool) -> int:
    display.end(fault)
    if json_lines:
        return 1 if fault else 0
    try:
        print_summary(path)
    finally:  # also when what was recorded cannot be read: this is why
        if fault:
            print_sentence(f"The session ended early: {fault}")
    return 1 if fault else 0
