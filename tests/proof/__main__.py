"""Proves the diagnosis on concealed data: families of cases by others, one blind run, then the sealed keys.

Each family's generator (tests/proof/families) is another process and writes recordings in the real format; the hash of
its key is printed and stored before the tool sees a recording. The tool gets recording and rig file and nothing else,
once. Then the key is opened and every gate is scored, family by family. The command may be broken off and called again:
it goes on where it was. Into the folder of --out go cases, keys, results, proof.json, proof.md, proof.html and the
pictures. Exit status: 0 when every gate that has cases is met in every family, 1 when not, 2 for a mistake in what was
asked.
"""

from __future__ import annotations

import argparse
import contextlib
import platform
import sys
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

import joblib
from rich.console import Console

from shared.errors import UserError
from shared.system.processes import usable_processors
from station.app.diagnosing import versions
from station.app.work import write_json
from station.pages.caption import made_by
from tests.proof.families import families
from tests.proof.page import html_page
from tests.proof.pictures import draw_all
from tests.proof.protocol import Protocol, tiers_of
from tests.proof.report import About, Column, as_json, column_of, markdown, printed, printed_rivals
from tests.proof.run import prove
from tests.proof.trial import tool_digest
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
    parser.add_argument("--family", metavar="NAME,…", help=f"only these of {', '.join(families())}")
    parser.add_argument("--tier", metavar="[FAMILY/]NAME[:N],…", help=tiers)
    parser.add_argument("--cases", type=int, metavar="N", help="cases of each tier, instead of the protocol's numbers")
    parser.add_argument(
        "--seed", type=int, default=1, help="of the generators; figures to report come from a fresh one"
    )
    parser.add_argument("--jobs", type=int, default=0, help="processes; 0: one for each core")
    parser.add_argument("--backend", metavar="NAME", help="joblib's (loky, dask, ray, …), instead of its own default")
    parser.add_argument("--out", type=Path, default=Path("proof"), metavar="FOLDER", help="where everything goes")
    size = parser.add_mutually_exclusive_group()
    size.add_argument("--quick", action="store_true", help="minutes (the default)")
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
    console = Console(width=None if sys.stdout.isatty() else 200)
    asked = _asked(options)
    spread = joblib.parallel_config(backend=options.backend) if options.backend else contextlib.nullcontext()
    with spread, made_by(_command(options)):
        columns = [_column(name, tiers, options, console) for name, tiers in asked.items()]
    about = About(
        date=f"{datetime.now().astimezone():%Y-%m-%d}",
        command=_command(options),
        versions=versions() | {"python": platform.python_version()},
        seed=options.seed,
        tool=tool_digest(),
    )
    console.print(printed(columns))
    for column in columns:
        if column.lines:
            console.print(printed_rivals(column))
    write_json(options.out / "proof.json", as_json(about, columns))
    (options.out / "proof.md").write_text(markdown(about, columns), encoding="utf-8")
    (options.out / "proof.html").write_text(html_page(about, columns), encoding="utf-8")
    told = f"{options.out / 'proof.html'}; the same as text: proof.md; all numbers: proof.json"
    console.print(f"The table, the keys' hashes and the pictures: {told}")
    return 1 if any(gate.met is False for column in columns for gate in column.gates) else 0


def _asked(options: argparse.Namespace) -> dict[str, dict[str, int]]:
    """The tiers of each family that was asked for, with their numbers of cases.

    Raises:
        UserError: for an unknown family or tier.
    """
    known = families()
    chosen = [name for name in (options.family or "").split(",") if name] or list(known)
    if unknown := [name for name in chosen if name not in known]:
        raise UserError(f"Expected families among {', '.join(known)}, got {', '.join(unknown)}")
    some = {name: family for name, family in known.items() if name in chosen}
    return tiers_of(
        {name: family.full for name, family in some.items()},
        {name: family.quick for name, family in some.items()},
        names=options.tier, cases=options.cases, is_quick=not options.full,
    )  # fmt: skip


def _column(name: str, tiers: dict[str, int], options: argparse.Namespace, console: Console) -> Column:
    """One family's proof."""
    compared = families()[name].rivalled and (options.full or options.rivals)
    proof = prove(
        families()[name],
        Protocol(tiers=tiers, seed=options.seed, out=options.out / name),
        jobs=options.jobs or usable_processors(),
        rivalled=options.rivals_cases if compared else 0,
        refits=not options.no_refits,
        console=console,
    )
    lines = versus(proof.cases, proof.absent) if compared else []
    return column_of(proof, lines, draw_all(proof.cases, options.out, name))


def _command(options: argparse.Namespace) -> str:
    words = [COMMAND]
    words += [f"--family {options.family}"] if options.family else []
    words += ["--full"] if options.full else []
    words += [f"--tier {options.tier}"] if options.tier else []
    words += [f"--cases {options.cases}"] if options.cases else []
    words += ["--rivals"] if options.rivals else []
    words += ["--no-refits"] if options.no_refits else []
    return " ".join([*words, f"--seed {options.seed}"])


if __name__ == "__main__":
    sys.exit(main())
