"""Replays a recording through the state machine: from the same messages it must take the same decisions.

Plan, seed and rig are those inside the recording. A rig whose arm is a file of one's own is given with --rig: what a
recording names is not opened. A difference means that the logic has changed since, or that the
recording does not hold what the station saw.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from shared.rig import load_rig
from shared.visible import visible
from station.app.described_otherwise import described_otherwise
from station.app.recorded_machine import machine_of
from station.app.recordings import other_rule
from station.recording.lost import lost
from station.recording.malformed import left_out
from station.recording.numbered import numbered
from station.recording.reader import open_recording
from station.sampling.machine import INPUTS
from station.sampling.replay import DECISIONS, first_of, replay

NAME = "check"
HELP = "replay a recording's messages: does the logic take the same decisions?"
EXAMPLE = "station check sim.mcap"
ONE = "the sampling logic takes other decisions than were recorded, or some of the recording is missing or forged"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument("file", type=Path, help="a recording (.mcap) of a session")
    parser.add_argument("--rig", type=Path, metavar="FILE", help="this rig file, instead of the one in the recording")


def run(options: argparse.Namespace) -> int:
    """Returns 0 when every decision is the same.

    It is 1 when one differs, a part or message is missing or too much, or the metadata contradict the rig file or plan.
    """
    reader = open_recording(options.file)
    stream = ((item.topic, item.message, item.log_ns) for item in reader.messages({*INPUTS, *DECISIONS}))
    own = None if options.rig is None else load_rig(options.rig)
    verdicts = replay(machine_of(reader, rig=own), stream)
    difference, count = first_of(verdicts), sum(verdict.decisions for verdict in verdicts.values())
    if note := left_out(reader.malformed):
        print(visible(note))
    if difference is not None:
        print(visible(f"{count} decisions are the same; the first that is not: {difference}"))
        if why := other_rule(reader):
            print(f"That may be no fault: {why}.")
        return 1
    if others := [str(other) for other in described_otherwise(reader)]:
        print(f"{count} decisions are the same, but the recording contradicts itself: {'; '.join(others)}.")
        return 1
    if gone := [sentence for _, sentence in lost(reader, numbered(reader)).by_rule()]:
        print(visible(f"{count} decisions are the same, but not all is there as it was written: {'; '.join(gone)}."))
        return 1
    print(f"All {count} decisions are the same.")
    return 0
