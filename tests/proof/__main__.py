"""Proves the diagnosis on concealed data: cases by an independent generator, one blind run, then the sealed key.

The generator is another process and writes recordings in the real format; the hash of
its key is printed and stored before the tool sees a recording. The tool gets recording and rig file and nothing else,
once. Then the key is opened and every gate is scored. The command may be broken off and called again: it goes on where
it was. Into the folder of --out go cases, keys, results, prove.json, prove.md and the figures. Exit status: 0 when
every gate that has cases is met, 1 when not, 2 for a mistake in what was asked.
"""

from __future__ import annotations

import argparse
import os
import platform
import sys
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

from rich.console import Console

from shared.errors import UserError
from station.app.diagnosing import versions
from station.app.work import write_json
from tests.proof.gates import gates
from tests.proof.pictures import draw_all
from tests.proof.protocol import QUICK, Protocol, tiers_of
from tests.proof.report import About, as_json, markdown, printed, printed_rivals
from tests.proof.run import left_out, prove
from tests.proof.versus import versus

COMMAND = "python -m tests.proof"
RIVALLED = 12
"""Nulls, singles and pairs that the rivals answer, of each so many: all of them would take longer than the rest."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Makes, runs, opens, scores; 0 when every gate that has cases is met, 2 for a mistake in what was asked."""
    try:
        return run(options_of(arguments))
    except UserError as error:
        print(error, file=sys.stderr)
        return 2


def options_of(arguments: Sequence[str] | None) -> argparse.Namespace:
    """The options; without --quick and --full it is the quick proof."""
    parser = argparse.ArgumentParser(prog=COMMAND, description=__doc__)
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
    return parser.parse_args(arguments)


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


def _command(options: argparse.Namespace) -> str:
    words = [COMMAND]
    words += ["--full"] if options.full else []
    words += [f"--tier {options.tier}"] if options.tier else []
    words += [f"--cases {options.cases}"] if options.cases else []
    words += ["--rivals"] if options.rivals else []
    return " ".join([*words, f"--seed {options.seed}"])


if __name__ == "__main__":
    sys.exit(main())
