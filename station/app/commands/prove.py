"""Proves the diagnosis on concealed data: cases by an independent generator, one blind run, then the sealed key.

The generator (tests/concealed, in a checkout) is another process and writes recordings in the real format; the hash of
its key is printed and stored before the tool sees a recording. The tool gets recording and rig file and nothing else,
once. Then the key is opened and every gate is scored. The command may be broken off and called again: it goes on where
it was. Into the folder of --out go cases, keys, results, prove.json, prove.md and the figures.
"""

from __future__ import annotations

import argparse
import os
import platform
import sys
from datetime import datetime
from pathlib import Path

from rich.console import Console

from shared.errors import UserError
from station.app.diagnosing import diagnose_file, versions
from station.app.setting import setting_of
from station.diagnosis.result import Diagnosis
from station.prove.gates import gates
from station.prove.pictures import draw_all
from station.prove.protocol import QUICK, Protocol, tiers_of
from station.prove.report import About, as_json, markdown, printed, printed_rivals
from station.prove.run import left_out, prove
from station.prove.trial import Tool
from station.prove.versus import versus
from station.prove.workers import write_json

NAME = "prove"
HELP = "prove the diagnosis on recordings with concealed effects"
EXAMPLE = "station prove"
ONE = "a gate is missed"

RIVALLED = 12
"""Nulls, singles and pairs that the rivals answer, of each so many: all of them would take longer than the rest."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    tiers = "only these tiers, or N cases of one; without it all of the protocol"
    parser.add_argument("--tier", metavar="NAME[:N],…", help=tiers)
    parser.add_argument("--cases", type=int, metavar="N", help="cases of each tier, instead of the protocol's numbers")
    parser.add_argument("--seed", type=int, default=1, help="of the generator; figures to report come from a fresh one")
    parser.add_argument("--jobs", type=int, default=0, help="processes; 0: one for each core")
    parser.add_argument("--out", type=Path, default=Path("proof"), metavar="FOLDER", help="where everything goes")
    size = parser.add_mutually_exclusive_group()
    size.add_argument("--quick", action="store_true", help=f"{sum(QUICK.values())} cases, minutes (the default)")
    size.add_argument("--full", action="store_true", help="the whole protocol with its rivals, hours")
    parser.add_argument("--rivals", action="store_true", help="run the rivals on the same cases, too (--full has them)")
    parser.add_argument(
        "--rivals-cases", type=int, default=RIVALLED, metavar="N", help=f"so many nulls, singles and pairs ({RIVALLED})"
    )
    parser.add_argument("--no-refits", action="store_true", help="leave out the oracle, and with it the gap closed")


def run(options: argparse.Namespace) -> int:
    """Makes, runs, opens, scores; 0 when every gate that has cases is met."""
    numbers = {"--seed": options.seed, "--jobs": options.jobs, "--rivals-cases": options.rivals_cases}
    for name, number in numbers.items():
        if number < 0:
            raise UserError(f"Expected 0 or more for {name}, got {number}")
    tiers = tiers_of(options.tier, options.cases, quick=not options.full)
    protocol = Protocol(tiers=tiers, seed=options.seed, out=options.out)
    console = Console(width=None if sys.stdout.isatty() else 160)
    proof = prove(
        protocol,
        Tool(diagnose=diagnosis_of, setting=setting_of),
        jobs=options.jobs or os.cpu_count() or 1,
        rivalled=options.rivals_cases if options.full or options.rivals else 0,
        refits=not options.no_refits,
        console=console,
    )
    about = About(
        date=f"{datetime.now().astimezone():%Y-%m-%d}",
        command=_command(options),
        versions=versions() | {"python": platform.python_version()},
        seed=options.seed,
        tiers={tier: sum(one.tier == tier for one in proof.cases) for tier in tiers},
        seals=proof.seals,
        tool=proof.digest,
        not_made=proof.not_made,
    )
    rows, lines = gates(proof.cases), versus(proof.cases, proof.absent) if options.full or options.rivals else []
    console.print(printed(rows))
    if lines:
        console.print(printed_rivals(lines))
    pictures = draw_all(proof.cases, options.out)
    write_json(options.out / "prove.json", as_json(about, rows, lines, proof.cases))
    text = markdown(about, rows, lines, left_out(proof.cases), [path.stem for path in pictures])
    (options.out / "prove.md").write_text(text, encoding="utf-8")
    console.print(f"Figures and tables: {options.out / 'prove.md'}, prove.json and {len(pictures)} pictures")
    return 1 if any(gate.met is False for gate in rows) else 0


def diagnosis_of(path: Path, *, rig: Path, seed: int) -> Diagnosis:
    """The answer of `station diagnose` for a file."""
    return diagnose_file(path, rig=rig, seed=seed).diagnosis


def _command(options: argparse.Namespace) -> str:
    words = ["station prove"]
    words += ["--full"] if options.full else []
    words += [f"--tier {options.tier}"] if options.tier else []
    words += [f"--cases {options.cases}"] if options.cases else []
    words += ["--rivals"] if options.rivals else []
    return " ".join([*words, f"--seed {options.seed}"])
