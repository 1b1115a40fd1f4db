"""The command that makes a tier's cases and their sealed key, whichever generator plans and writes them.

The key's hash is printed and written before any recording exists. Cases that exist are left as they are.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Protocol, TypeVar

from station.pool import spread
from tests.concealed.sealing import finished, sealed

T = TypeVar("T")
KEY, HASH = "key.json", "key.sha256"


class Planned(Protocol):
    """A case before it is written: its folder's name, and its line of the key."""

    @property
    def id(self) -> str:
        """A name that tells nothing."""
        ...

    @property
    def entry(self) -> dict[str, Any]:
        """The key's entry of what is concealed."""
        ...


class PlanCase(Protocol):
    """Plans a tier's case number `index`; the same arguments give the same plan. A function of a module."""

    def __call__(self, tier: str, index: int, *, seed: int, only: Collection[str]) -> Planned:
        """The plan; raises ValueError if nothing of the tier is called as `only` says."""
        ...


class WriteCase(Protocol):
    """Writes a planned case's folder within `out`, the recording last. A function of a module."""

    def __call__(self, plan: Any, out: Path) -> None:
        """Writes it."""
        ...


def make(
    arguments: Sequence[str] | None, *, prog: str, about: str | None, tiers: Sequence[str], plan: PlanCase,
    write: WriteCase, done: Callable[[Path], bool] = finished,
) -> int:  # fmt: skip
    """Plans all cases, seals the key, then writes those whose folders are not `done`; the exit status."""
    options = _options(arguments, prog=prog, about=about, tiers=tiers)
    if options.cases < 1 or options.jobs < 1 or options.seed < 0:
        print("Expected --cases and --jobs of 1 or more and --seed of 0 or more", file=sys.stderr)
        return 2
    only = tuple(name for name in options.only.split(",") if name)
    out, key_folder = options.out, options.key or options.out
    out.mkdir(parents=True, exist_ok=True)
    key_folder.mkdir(parents=True, exist_ok=True)
    planning = partial(plan, options.tier, seed=options.seed, only=only)
    with spread(planning, range(options.cases), jobs=options.jobs) as planned:
        plans = list(_progress(planned, options.cases, "planned"))
    told = {"tier": options.tier, "seed": options.seed, "only": list(only)}
    text, digest = sealed(told | {"cases": {one.id: one.entry for one in plans}})
    if not _seal(key_folder, text, digest):
        return 2
    missing = [one for one in plans if not done(out / one.id)]
    with spread(partial(write, out=out), missing, jobs=options.jobs) as written:
        list(_progress(written, len(missing), "written"))
    print(f"{len(plans)} cases in {out}, {len(missing)} of them written now")
    return 0


def _options(
    arguments: Sequence[str] | None, *, prog: str, about: str | None, tiers: Sequence[str]
) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog=prog, description=about)
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER", help="where the cases go")
    parser.add_argument("--tier", choices=tiers, required=True)
    parser.add_argument("--cases", type=int, required=True, metavar="N")
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--only", default="", metavar="ID,…", help="only these effects (for development)")
    parser.add_argument("--key", type=Path, metavar="FOLDER", help="where key and hash go, if not beside the cases")
    return parser.parse_args(arguments)


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


def _progress(done: Iterable[T], count: int, what: str) -> Iterator[T]:
    for number, item in enumerate(done, start=1):
        print(f"{what} {number} of {count}", end="\r" if sys.stderr.isatty() else "\n", file=sys.stderr, flush=True)
        yield item
