"""Simulates a recorded session again: the same commands, each run from its recorded pose, with a model of friction.

The model is a TOML file, such as `station diagnose` writes: mu_s in the table [friction], and a table such as
[effects.contact_aging] with its parameters for each effect. Without one it is the friction that the recording shows.
Effects are added with --plant, such as --plant kinetic_drop=0.3; `station effects` lists them. The result is a
recording like the one that was measured.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from rich.console import Console

from shared.arguments import seed_of
from station.app.bars import counting
from station.app.front.simulation import simulate
from station.app.progress import stages
from station.simulators.simulator import names

NAME = "simulate"
HELP = "simulate a recorded session again with a model of friction; write it as a recording"
EXAMPLE = "station simulate sim.mcap --model model.toml --out again.mcap"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument("file", type=Path, help="the recorded session (.mcap)")
    parser.add_argument(
        "--model", type=Path, metavar="MODEL.toml", help="friction and effects; without it the friction as recorded"
    )
    parser.add_argument(
        "--plant",
        action="append",
        default=[],
        metavar="ID=VALUE",
        help="add an effect, or change one parameter of it with ID.PARAMETER=VALUE; may be repeated",
    )
    parser.add_argument("--simulator", default="planar", help=f"one of {', '.join(names())}")
    parser.add_argument("--out", type=Path, required=True, metavar="SIM.mcap", help="the recording to write")
    parser.add_argument("--rig", type=Path, help="rig file; the one in the recording is the default")
    parser.add_argument(
        "--seed",
        type=seed_of,
        help="draw scatter, shaking and the corners' noise; without it nothing is left to chance",
    )


def run(args: argparse.Namespace) -> int:
    """Simulates, writes, and says how far the onsets are apart."""
    console = Console(stderr=True, highlight=False)
    with stages(console, f"simulating {args.file} with {args.simulator}"):
        simulated = simulate(
            args.file, args.model, plant=args.plant, simulator=args.simulator, rig=args.rig, seed=args.seed
        )
    total = simulated.reader.measured_count
    with counting(console, f"writing {args.out.name}", total=total, what="messages written") as done:
        count = simulated.write(args.out, on_message=done)
    print("\n".join(simulated.apart))
    print(f"{args.out}: {count} messages, {len(simulated.every_sample)} runs simulated by {args.simulator}")
    print(f"Look at it:  station replay {args.out}")
    return 0
