"""Runs the test suite as on other processors and on a busy machine: `make test-portable`."""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from tests.portable.paths import paths
from tests.portable.suite import ROOT, Outcome, run_suite
from tests.portable.variants import Variant, taken, variants

HEAD = f"{'variant':<14}{'passed':>8}{'failed':>8}{'skipped':>9}{'minutes':>9}   failing tests"


def parser() -> argparse.ArgumentParser:
    """The options."""
    options = argparse.ArgumentParser(prog="python -m tests.portable", description=__doc__)
    options.add_argument("tests", nargs="*", default=["tests"], help="files, folders or names of tests (default: all)")
    options.add_argument("--variant", action="append", metavar="NAME", help="only this one; may be given again")
    options.add_argument("--list", action="store_true", help="only say which variants this machine has")
    options.add_argument("--jobs", type=int, default=2, help="processes that run tests (default: %(default)s)")
    options.add_argument("--out", type=Path, default=ROOT / "build" / "portable", help="where outputs go")
    return options


def main(arguments: Sequence[str] | None = None) -> int:
    """0 if every test passed under every variant, 1 if one failed, 2 for words that mean nothing here."""
    words = parser()
    options = words.parse_args(arguments)
    known = {one.name: one for one in worthwhile()}
    if unknown := [name for name in options.variant or () if name not in known]:
        words.error(f"expected --variant to be one of {', '.join(known)}, got {unknown[0]}")
    chosen = [known[name] for name in options.variant or known]
    for one in chosen:
        print(f"{one.name:<14}{one.about}", flush=True)
    if options.list:
        return 0
    print(f"\n{HEAD}", flush=True)
    failed = False
    for one in chosen:
        outcome = run_suite(one, tests=options.tests, jobs=options.jobs, folder=options.out / one.name)
        print(row(outcome), flush=True)
        failed = failed or bool(outcome.failed)
    print(f"\nThe outputs are in {options.out}/<variant>/output.txt.")
    return int(failed)


@cache
def worthwhile() -> tuple[Variant, ...]:
    """The variants whose code paths are not those that this machine takes anyway: a process is started for each."""
    here = paths()
    return tuple(one for one in variants(here) if one.busy or taken(one) != here)


def row(outcome: Outcome) -> str:
    """One line of the table, and a further one for each failing test but the first."""
    counts = f"{outcome.passed:>8}{len(outcome.failed):>8}{outcome.skipped:>9}{outcome.minutes:>9.1f}   "
    return f"{outcome.variant:<14}{counts}" + f"\n{'':{14 + 34 + 3}}".join(outcome.failed or ("none",))


def _end(number: int, _frame: object) -> None:
    sys.exit(128 + number)


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, _end)
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
