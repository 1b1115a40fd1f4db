"""`python -m tests.concealed --out FOLDER --tier TIER --cases N --seed S`: makes cases and their sealed key.

The key's hash is printed and written before any recording exists. Cases that exist are left as they are.
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TypeVar

from tests.concealed.cases import TIERS, finished, sealed, write_case
from tests.concealed.tiers import plan_case

T = TypeVar("T")
KEY, HASH = "key.json", "key.sha256"


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.concealed", description=__doc__)
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER", help="where the cases go")
    parser.add_argument("--tier", choices=TIERS, required=True)
    parser.add_argument("--cases", type=int, required=True, metavar="N")
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--only", default="", metavar="ID,…", help="only these effects (for development)")
    parser.add_argument("--key", type=Path, metavar="FOLDER", help="where key and hash go, if not beside the cases")
    return parser.parse_args(arguments)


def main(arguments: Sequence[str] | None = None) -> int:
    """Plans all cases, seals the key, then writes what is missing."""
    options = _options(arguments)
    if options.cases < 1 or options.jobs < 1 or options.seed < 0:
        print("Expected --cases and --jobs of 1 or more and --seed of 0 or more", file=sys.stderr)
        return 2
    only = tuple(name for name in options.only.split(",") if name)
    out, key_folder = options.out, options.key or options.out
    out.mkdir(parents=True, exist_ok=True)
    key_folder.mkdir(parents=True, exist_ok=True)
    with multiprocessing.get_context("spawn").Pool(options.jobs) if options.jobs > 1 else _Here() as pool:
        # A function of this file would not be found by another process: it has no __main__ of ours.
        plan = partial(plan_case, options.tier, seed=options.seed, only=only)
        plans = list(_progress(pool.imap(plan, range(options.cases)), options.cases, "planned"))
        told = {"tier": options.tier, "seed": options.seed, "only": list(only)}
        text, digest = sealed(told | {"cases": {plan.id: plan.entry for plan in plans}})
        if not _seal(key_folder, text, digest):
            return 2
        missing = [plan for plan in plans if not finished(out / plan.id)]
        list(_progress(pool.imap(partial(write_case, out=out), missing), len(missing), "written"))
    print(f"{len(plans)} cases in {out}, {len(missing)} of them written now")
    return 0


def _seal(folder: Path, text: str, digest: str) -> bool:
    """Writes hash and key; refuses a folder that holds another key."""
    seal = folder / HASH
    if seal.exists() and seal.read_text(encoding="utf-8").split()[0] != digest:
        print(
            f"Expected the key sealed in {seal}, got another one: that folder holds cases of another tier, number, "
            "seed or version; choose a new folder",
            file=sys.stderr,
        )
        return False
    print(f"key sha256 {digest}", flush=True)
    seal.write_text(f"{digest}  {KEY}\n", encoding="utf-8")
    (folder / KEY).write_text(text, encoding="utf-8")
    return True


class _Here:
    """Stands in for a pool: does everything in this process."""

    def __enter__(self) -> _Here:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    imap = map


def _progress(done: Iterable[T], count: int, what: str) -> Iterator[T]:
    for number, item in enumerate(done, start=1):
        print(f"{what} {number} of {count}", end="\r" if sys.stderr.isatty() else "\n", file=sys.stderr, flush=True)
        yield item


if __name__ == "__main__":
    sys.exit(main())
