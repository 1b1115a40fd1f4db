"""Compares the rig's angle sources as the paper did (Table I, Fig. 3).

It tilts the plate to 10 degrees and back five times, reads every source at every stop, and records everything. Live, it
expects the arm agent on the bus and reads the sources of `[angles]` itself, unless `station angles` is running. With
--lockstep the twin, the arm agent and the sources run in simulated time in this one process. With --from it computes
the same from a recording. To stop, press Ctrl-C: the arm then holds, and levels slowly by itself.
"""

from __future__ import annotations

import argparse
import json
import sys
import threading
from contextlib import ExitStack, closing
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from shared.bus import Bus
from shared.clock import Clock, SimulatedClock, SystemClock
from shared.config import json_table, parse
from shared.errors import UserError
from shared.memory_bus import MemoryBus
from shared.rig import RigConfig
from shared.system.signals import until_stopped
from shared.zenoh_bus import ZenohBus
from station.angles.compare import COMMANDED, Comparison, compare
from station.angles.conductor import Conductor
from station.angles.instruments import Instruments, source_names
from station.angles.plan import ComparisonPlan
from station.angles.procedure import Procedure
from station.angles.report import fits_csv, table_csv, text_of
from station.angles.settings import SourceName
from station.angles.stops import is_needed, stops_of
from station.angles.watch import WARNING, Note
from station.app import assembly
from station.app.claim import claim_arm, session_name
from station.arm.agent import arm_agent
from station.pages.caption import command_line, made_by
from station.recording.provenance import Provenance
from station.recording.reader import RecordingReader, open_recording
from station.recording.recorder import Recorder, record_within
from station.recording.writer import Recording
from station.simulators.mujoco.twin import Twin

NAME = "compare-angles"
HELP = "compare the angle sensors (the paper's Table I and Fig. 3)"
EXAMPLE = "station compare-angles --lockstep --out angles.mcap"
ONE = "the comparison ended early"
STOPPED = "1 while it compares on the bus"
_RETURN_S = 2.0
"""The longest that the end waits for the events to come back from the bus, and so to the recorder."""
_TICK_S = 0.004
_LOCKSTEP_NS = 10_000_000
_PRESENCE_S = 3.0
_OTHERS_S = 2.0  # a process that was there before finds us again within its retry of one second
_SIMULATED = {"simulated", "kinematics", "typed"}
_HELP = {
    "to_deg": "the steepest tilt",
    "step_deg": "the tilt between two stops",
    "sweeps": "how often the plate is tilted",
    "readings": "readings of every source at a stop",
    "direction": "the direction of the tilt, 0 to 3",
    "rate_deg_s": "how fast the plate is tilted",
    "settle_s": "rest before a stop is read, in seconds",
    "patience_s": "how long a stop waits for a source that says nothing, in seconds",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options; those of the procedure have the paper's values."""
    parser.add_argument("--rig", help="rig file; without it the simulated rig that comes with Repose")
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument("--out", type=Path, metavar="FILE.mcap", help="record to this file")
    where.add_argument("--from", dest="source", type=Path, metavar="FILE.mcap", help="compute from this recording")
    parser.add_argument("--overwrite", action="store_true", help="replace a recording of that name")
    parser.add_argument("--lockstep", action="store_true", help="simulated time, one process, faster than life")
    parser.add_argument("--take-over", action="store_true", help="take the arm over from a session that has it")
    parser.add_argument("--reference", default=COMMANDED, help="the source that the others are held against")
    parser.add_argument("--table", type=Path, metavar="FILE.csv", help="write Table I")
    parser.add_argument(
        "--fits", type=Path, metavar="FILE.csv", help="write offset, gain and hysteresis of each source"
    )
    parser.add_argument("--figure", type=Path, metavar="FILE.png", help="draw Fig. 3 (png, svg or pdf)")
    parser.add_argument("--report", type=Path, metavar="FILE.html", help="write it all as one page")
    for spec in fields(ComparisonPlan):
        if spec.name in _HELP:
            kind = int if isinstance(spec.default, int) else float
            flag = "--" + spec.name.replace("_", "-")
            parser.add_argument(flag, type=kind, default=spec.default, help=_HELP[spec.name])
    parser.add_argument("--no-way-back", action="store_true", help="no stops on the way down (and no hysteresis)")


def run(args: argparse.Namespace) -> int:
    """Gives 0, or 1 when the comparison had to stop early; what was recorded until then is compared all the same."""
    if args.source is not None:
        _present(args, args.source)
        return 0
    rig, plan = assembly.rig_from(args.rig), _plan(args)
    _check_rig(rig, lockstep=args.lockstep)
    failure, path = _lockstep(args, rig, plan) if args.lockstep else _live(args, rig, plan)
    if failure:
        print(f"The comparison ended early: {failure}\n", file=sys.stderr)
    print(f"Recorded to {path}.\n")
    _present(args, path)
    return 1 if failure else 0


def _plan(args: argparse.Namespace) -> ComparisonPlan:
    try:
        return ComparisonPlan(**{name: getattr(args, name) for name in _HELP}, way_back=not args.no_way_back)
    except ValueError as error:
        raise UserError(f"The comparison cannot be carried out: {error}") from error


def _check_rig(rig: RigConfig, *, lockstep: bool) -> None:
    if not rig.angles.values:
        raise UserError("Expected angle sources in the rig file: add at least one table such as [angles.kinematics]")
    real = [source.name for source in source_names(rig.angles) if source.kind not in _SIMULATED]
    if lockstep and real:
        raise UserError(
            f"Expected only sources of the kinds {', '.join(sorted(_SIMULATED))} with --lockstep, but "
            f"{', '.join(real)} is a real sensor: leave --lockstep out"
        )


def _origin(rig: RigConfig, plan: ComparisonPlan, *, clock: Clock, lockstep: bool) -> Provenance:
    return Provenance(
        rig_id=rig.id,
        started_ns=clock.now_ns(),
        mode="lockstep" if lockstep else "live",
        rig_toml=rig.text,
        own_rig=rig.arm.own,
        extra={"comparison": json.dumps(asdict(plan))},
    )


def _say(note: Note) -> None:
    print(note.text, file=sys.stderr, flush=True)


# --- in simulated time ------------------------------------------------------------------------------------------------


def _lockstep(args: argparse.Namespace, rig: RigConfig, plan: ComparisonPlan) -> tuple[str, Path]:
    clock = SimulatedClock()
    bus = MemoryBus(clock)
    origin = _origin(rig, plan, clock=clock, lockstep=True)
    recording = Recording(args.out, provenance=origin, overwrite=args.overwrite, flush_every_s=10.0)
    with closing(recording):
        record_within(bus, recording)
        world = assembly.twin_world(rig, seed=1, start_ns=clock.now_ns())
        world.remove_block()
        twin, arm = Twin(bus, world), arm_agent(bus, assembly.arm_settings(rig))
        instruments = Instruments(bus, rig.angles, clock=clock, threaded=False)
        sources = source_names(rig.angles)
        procedure = Procedure(plan, sources=sources)
        conductor = Conductor(bus, procedure, sources=sources, clock=clock, on_note=_warn)
        while not conductor.finished:
            clock.advance_to(clock.now_ns() + _LOCKSTEP_NS)
            twin.tick(clock.now_ns())
            arm.tick(clock.now_ns())
            for note in instruments.tick():
                _say(note)
            conductor.tick()
        instruments.close()
    return procedure.failure or recording.stopped, recording.path


def _warn(note: Note) -> None:
    if note.level >= WARNING:
        _say(note)


# --- live -------------------------------------------------------------------------------------------------------------


def _live(args: argparse.Namespace, rig: RigConfig, plan: ComparisonPlan) -> tuple[str, Path]:
    clock = SystemClock()
    with ExitStack() as stack:
        stopped = stack.enter_context(until_stopped())
        bus = ZenohBus.of("station", rig, clock=clock)
        stack.callback(bus.close)
        bus.announce("station")
        _await_arm(bus, rig, clock=clock)
        owner = session_name()
        claim_arm(bus, clock=clock, owner=owner, take_over=args.take_over)
        origin = _origin(rig, plan, clock=clock, lockstep=False)
        recording = Recording(args.out, provenance=origin, overwrite=args.overwrite)
        end = _End(stopped)
        recorder = Recorder(bus, recording, clock=clock, on_stopped=end.ask)
        stack.callback(recorder.close)
        failure = _conduct(bus, rig, plan, clock=clock, end=end, owner=owner)
    return failure or recording.stopped, recording.path


@dataclass(slots=True)
class _End:
    """The reason to end early; empty while there is none."""

    stopped: threading.Event
    reason: str = "stopped by the user"

    def ask(self, reason: str) -> None:
        """Asks for the end; may come from any thread."""
        self.reason = reason
        self.stopped.set()


def _await_arm(bus: Bus, rig: RigConfig, *, clock: Clock) -> None:
    """Waits for the arm agent, and a moment longer for whoever else is there."""
    begin_ns = clock.now_ns()
    while "arm" not in bus.alive():
        if (clock.now_ns() - begin_ns) * 1e-9 > _PRESENCE_S:
            raise UserError(
                f"Expected the arm agent on the bus of rig '{rig.id}' within {_PRESENCE_S:g} s: "
                "start station arm --rig RIG.toml"
            )
        bus.poll(0.05)
    end_ns = clock.now_ns() + round(_OTHERS_S * 1e9)
    while clock.now_ns() < end_ns:
        bus.poll(0.05)


def _conduct(bus: Bus, rig: RigConfig, plan: ComparisonPlan, *, clock: Clock, end: _End, owner: str) -> str:
    sources: tuple[SourceName, ...] = source_names(rig.angles)
    procedure = Procedure(plan, sources=sources)
    conductor = Conductor(bus, procedure, sources=sources, clock=clock, on_note=_say, owner=owner)
    with ExitStack() as own:
        if "angles" not in bus.alive():
            instruments = Instruments(bus, rig.angles, clock=clock)
            own.callback(instruments.close)
        else:
            instruments = None
        while not conductor.finished and not end.stopped.is_set():
            bus.poll(_TICK_S)
            if instruments and "angles" in bus.alive():
                _say(Note(WARNING, "`station angles` has appeared: its readings are taken from now on, not our own."))
                own.close()
                instruments = None
            for note in instruments.tick() if instruments else ():
                _say(note)
            conductor.tick()
        # Disarming stops a motion, and the arm's report of that is not the reason.
        failure = procedure.failure or (end.reason if not conductor.finished else "")
        conductor.disarm()
        until_ns = clock.now_ns() + round(_RETURN_S * 1e9)
        bus.poll(_TICK_S)
        while not conductor.all_came_back and clock.now_ns() < until_ns:
            bus.poll(_TICK_S)
    return failure


# --- the result -------------------------------------------------------------------------------------------------------


def _present(args: argparse.Namespace, path: Path) -> None:
    """Prints and writes what a recording shows; live and later the same, because both read the file."""
    recording = open_recording(path)
    stops = stops_of(item.message for item in recording.messages(_needed(recording)))
    if not stops:
        raise UserError(f"Expected stops of the plate in {path}, but there is none: nothing can be compared")
    result = compare(stops, reference=args.reference, readings=_readings(recording, args.readings))
    print(text_of(result))
    for target, text in ((args.table, table_csv), (args.fits, fits_csv)):
        if target is not None:
            _write(target, text(result))
    reference = None if args.reference == COMMANDED else args.reference
    with made_by(command_line("station", "compare-angles", "--from", path, reference=reference, report=args.report)):
        _draw(args, result, path)


def _draw(args: argparse.Namespace, result: Comparison, path: Path) -> None:
    if args.figure is not None:
        # Imported here because matplotlib takes half a second, which every other use would wait for.
        from station.angles.figure import write_figure  # noqa: PLC0415

        write_figure(result, args.figure)
    if args.report is not None:
        from station.angles.page import comparison_page  # noqa: PLC0415  # as above

        _write(args.report, comparison_page(result, source=str(path)))


def _needed(recording: RecordingReader) -> list[str]:
    return [topic for topic in recording.topics if is_needed(topic)]


def _readings(recording: RecordingReader, asked: int) -> int:
    """Returns the number of readings at a stop: the recording's own, or what was asked for where it does not say."""
    text = recording.metadata.get("session", {}).get("comparison", "")
    return parse(ComparisonPlan, json_table(text, "comparison of the recorded session")).readings if text else asked


def _write(path: Path, text: str) -> None:
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise UserError(f"Expected to write {path}, but it cannot be written: {error.strerror}") from error
