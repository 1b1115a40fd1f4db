"""Records everything on a rig's bus until it is stopped, without deciding anything.

For sessions that somebody else runs, and for recordings that `station replay --bus` plays back.
"""

from __future__ import annotations

import argparse
from contextlib import ExitStack

from shared.bus_rights import OBSERVER
from shared.clock import SystemClock
from shared.system.signals import until_stopped
from shared.zenoh_bus import ZenohBus
from station.app import assembly, recordings
from station.app.processes import paced
from station.recording.provenance import Provenance
from station.recording.recorder import Recorder
from station.recording.writer import Recording

NAME = "record"
HELP = "record what is on the bus, without running a session"
EXAMPLE = "station record --rig rig.toml"
ONE = "recording stopped by itself: the disk is full, or a write failed"
STOPPED = "0 once it records"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument("--rig", help="rig file; without it the simulated rig that comes with Repose")
    parser.add_argument("--out", help="the recording; without it recordings/<time>.mcap")
    parser.add_argument("--overwrite", action="store_true", help="replace a recording of that name")
    recordings.add_split(parser)
    parser.add_argument("--seconds", type=float, default=0.0, help="how long; 0: until it is stopped")


def run(options: argparse.Namespace) -> int:
    """Records until Ctrl-C, SIGTERM, a full disk, or the end of the time."""
    rig, clock = assembly.rig_from(options.rig), SystemClock()
    path = recordings.recording_path(options.out)
    stopped_by: list[str] = []
    with ExitStack() as stack:
        stopped = stack.enter_context(until_stopped())
        bus = ZenohBus.of(OBSERVER, rig, clock=clock)
        stack.callback(bus.close)
        origin = Provenance(rig_id=rig.id, started_ns=clock.now_ns(), rig_toml=rig.text, own_rig=rig.arm.own)
        recording = Recording(path, provenance=origin, overwrite=options.overwrite, split_bytes=options.split)
        recorder = Recorder(bus, recording, clock=clock, on_stopped=stopped_by.append)
        stack.callback(recorder.close)
        print(f"Recording the bus of rig '{rig.id}' to {path}. Ctrl-C ends it.", flush=True)
        end_ns = clock.now_ns() + round(options.seconds * 1e9)
        for now_ns in paced(clock, bus, rate_hz=20.0, stopped=stopped):
            if stopped_by or (options.seconds > 0 and now_ns > end_ns):
                break
    print(f"Recording: {recording.path}" + (f" ({stopped_by[0]})" if stopped_by else ""))
    return 1 if stopped_by else 0
