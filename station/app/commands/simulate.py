"""Simulates a recorded session again: the same commands, each run from its recorded pose, with a model of friction.

The model is a TOML file, such as `station diagnose` writes: mu_s in the table [friction], and a table such as
[effects.contact_aging] with its parameters for each effect. The result is a recording like the one that was measured.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from shared.errors import UserError
from shared.messages import Sample
from station.app import simulating
from station.app.retold_recording import write_retold
from station.recording.arrays import load_signals
from station.recording.reader import open_recording
from station.simulators.simulator import Elsewhere, OwnFriction, names

NAME = "simulate"
HELP = "simulate a recorded session again with a model of friction; write it as a recording"
_LISTED = 20


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument("file", type=Path, help="the recorded session (.mcap)")
    parser.add_argument("--model", type=Path, required=True, metavar="MODEL.toml", help="friction and effects")
    parser.add_argument("--simulator", default="planar", help=f"one of {', '.join(names())}")
    parser.add_argument("--out", type=Path, required=True, metavar="SIM.mcap", help="the recording to write")
    parser.add_argument("--rig", type=Path, help="rig file; the one in the recording is the default")
    parser.add_argument(
        "--seed", type=int, help="draw scatter, shaking and the corners' noise; without it nothing is left to chance"
    )


def run(args: argparse.Namespace) -> int:
    """Simulates, writes, and says how far the onsets are apart."""
    reader = open_recording(args.file)
    rig = simulating.rig_of(reader, path=args.rig)
    model = simulating.model_of(args.model, rig=rig)
    recorded = load_signals(reader)
    rng = None if args.seed is None else np.random.default_rng(args.seed)
    engine = simulating.simulator_of(args.simulator)
    if isinstance(engine, OwnFriction) and not isinstance(engine, Elsewhere):
        raise UserError(
            f"Expected {' or '.join(names())} to simulate with a model, but {args.simulator} has a friction of its "
            "own: station diagnose --simulate runs it as it is, and with what was found"
        )
    simulated = engine.repeat(recorded, model, rig=rig, rng=rng)
    said = {"simulated_from": args.file.name, "simulator": args.simulator}
    if args.seed is not None:
        said["simulation_seed"] = str(args.seed)
    text = args.model.read_text(encoding="utf-8")
    count = write_retold(reader, simulated, args.out, rig=rig, said=said, model_toml=text)
    print("\n".join(difference(recorded.samples, simulated.samples)))
    print(f"{args.out}: {count} messages, {len(simulated.samples)} runs simulated by {args.simulator}")
    print(f"Look at it:  station replay {args.out}")
    return 0


def difference(recorded: Sequence[Sample], simulated: Sequence[Sample]) -> list[str]:
    """Lines that say how far simulated onsets are from recorded ones: run by run if few, else the farthest."""
    again = {sample.run: sample for sample in simulated}
    pairs = [(sample, again[sample.run]) for sample in recorded if sample.run in again]
    both = [(was, now) for was, now in pairs if not was.censored and not now.censored]
    lines = ["run   recorded  simulated  simulated − recorded (onset, degrees)"] if both else []
    ranked = sorted(both, key=lambda pair: -abs(_apart_deg(*pair)))[:_LISTED]
    lines += [_line(was, now) for was, now in sorted(ranked, key=lambda pair: pair[0].run)]
    if len(both) > _LISTED:
        lines.append(f"(the {_LISTED} farthest apart of {len(both)} runs)")
    if both:
        apart = np.array([_apart_deg(*pair) for pair in both])
        rms = math.sqrt(float(np.mean(apart**2)))
        lines.append(f"Onsets of {len(both)} runs: mean difference {apart.mean():+.3f}°, root mean square {rms:.3f}°")
    held = sum(now.censored and not was.censored for was, now in pairs)
    slipped = sum(was.censored and not now.censored for was, now in pairs)
    if held or slipped:
        lines.append(f"{held} runs slid in the recording only, {slipped} in the simulation only")
    return lines or ["No run has an onset to compare"]


def _apart_deg(was: Sample, now: Sample) -> float:
    return math.degrees(now.onset_angle_rad - was.onset_angle_rad)


def _line(was: Sample, now: Sample) -> str:
    first, second = math.degrees(was.onset_angle_rad), math.degrees(now.onset_angle_rad)
    return f"{was.run:3d} {first:10.3f} {second:10.3f} {_apart_deg(was, now):+10.3f}"
