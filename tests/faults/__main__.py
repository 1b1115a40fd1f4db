"""`python -m tests.faults --times 3 --seed 1`: every row of the fault table on a rig of real processes.

With root each process has a cable of its own (network namespaces); without it the rows that need one are left out,
which is said. The table is printed as Markdown; `--json FILE` keeps every trial, and `--kept FILE`, given again for
each file, prints one table of the trials of several calls and runs nothing. Exit status 1 when something was lost that
nobody tells of, a recording is not valid, or the plate rose while station or camera was away.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from random import Random
from typing import Any

from shared.errors import UserError
from tests.faults import network
from tests.faults.lab import FailedError, Lab
from tests.faults.row import Row, all_rows
from tests.faults.trial import Outcome, line_of, try_once

NAMES = ("camera", "arm", "twin", "station", "stranger")
MOST_RISE_DEG = 0.5
"""The simulated arm settles by a few tenths of a degree when it stops."""
DISK_MB = 200


def main(words: Sequence[str] | None = None) -> int:
    """Runs the rows that were asked for."""
    options = _parser().parse_args(words)
    for number in (signal.SIGHUP, signal.SIGINT, signal.SIGTERM):
        # The rig is taken down whatever ends this. A handler is no child's: nohup's and a shell's "ignored" would be.
        signal.signal(number, signal.default_int_handler)
    rows = [row for row in all_rows() if any(part in row.name for part in options.row or [""])]
    if options.list:
        print("\n".join(row.name for row in rows))
        return 0
    if options.kept:
        return _of_kept(rows, options.kept)
    cables = network.possible()
    if not cables:
        left = [row.name for row in rows if row.network]
        print(f"Without root there are no cables of our own: {len(left)} rows are left out", flush=True)
        rows = [row for row in rows if not row.network]
    return _run(options, rows, network.Network(NAMES) if cables else None)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m tests.faults", description=__doc__)
    parser.add_argument("--row", action="append", metavar="WORDS", help="rows whose name has these words; repeatable")
    parser.add_argument("--times", type=int, default=3, help="trials of each row, each at another moment of a run")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", type=Path, metavar="FILE", help="keep every trial")
    parser.add_argument("--kept", type=Path, action="append", metavar="FILE", help="tell of kept trials; repeatable")
    parser.add_argument("--list", action="store_true", help="only name the rows")
    return parser


def _run(options: argparse.Namespace, rows: Sequence[Row], cables: network.Network | None) -> int:
    bad, kept = 0, list[dict[str, Any]]()
    with tempfile.TemporaryDirectory() as name:
        lab = Lab(Path(name), cables)
        try:
            if cables is not None:
                cables.make()
            lab.make()
            laid = None
            for number, row in enumerate(rows):
                if cables is not None and laid != row.ext4:
                    lab.mount(DISK_MB, ext4=row.ext4)
                    laid = row.ext4
                outcomes, failed = _trials(lab, row, options)
                _print_line(line_of(row.name, outcomes, failed, row), first=not number)
                bad += is_bad(row, outcomes) or bool(failed)
                kept += [asdict(outcome) for outcome in outcomes] + [{"row": row.name, "failed": why} for why in failed]
                if options.json:
                    options.json.write_text(json.dumps(kept, indent=1), encoding="utf-8")
        finally:
            lab.close()
            lab.unmount()
            if cables is not None:
                cables.remove()
    return 1 if bad else 0


def _trials(lab: Lab, row: Row, options: argparse.Namespace) -> tuple[list[Outcome], list[str]]:
    outcomes, failed = list[Outcome](), list[str]()
    for number in range(options.times):
        try:
            outcomes.append(try_once(lab, row, Random(f"{options.seed} {row.name} {number}")))
        except (FailedError, UserError, subprocess.SubprocessError, OSError) as error:
            failed.append(f"trial {number}: {error}")
            lab.close()  # the next one begins with fresh processes
        lab.sweep()
    return outcomes, failed


def _of_kept(rows: Sequence[Row], files: Sequence[Path]) -> int:
    """Prints the table of the trials that earlier calls kept in these files, all together."""
    kept = [one for file in files for one in json.loads(file.read_text(encoding="utf-8"))]
    if unknown := {one["row"] for one in kept} - {row.name for row in all_rows()}:
        raise SystemExit(f"Expected trials of the table's rows, got some of {', '.join(sorted(unknown))}")
    bad, first = False, True
    for row in rows:
        own = [one for one in kept if one["row"] == row.name]
        failed = [one["failed"] for one in own if "failed" in one]
        outcomes = [Outcome(**one) for one in own if "failed" not in one]
        if own:
            _print_line(line_of(row.name, outcomes, failed, row), first=first)
            bad, first = bad or is_bad(row, outcomes) or bool(failed), False
    return int(bad)


def _print_line(line: dict[str, Any], *, first: bool) -> None:
    if first:
        print(_markdown(list(line), rule=True), flush=True)
    print(_markdown([str(value) for value in line.values()]), flush=True)


def is_bad(row: Row, outcomes: Sequence[Outcome]) -> bool:
    """True if something was lost untold, a recording is not valid, or the plate rose while somebody was away."""
    lost = sum(one.lost for one in outcomes) > sum(one.counted for one in outcomes)
    return (
        lost
        or any(one.lost_samples or not one.valid for one in outcomes)
        or (row.blind and any(one.rose_deg > MOST_RISE_DEG for one in outcomes))
    )


def _markdown(cells: Sequence[str], *, rule: bool = False) -> str:
    line = "| " + " | ".join(cell.replace("|", "/").replace("\n", " ") for cell in cells) + " |"
    return line + ("\n|" + "---|" * len(cells) if rule else "")


if __name__ == "__main__":
    assert os.name == "posix", "it needs signals of POSIX"
    sys.exit(main())
