"""Makes the cases of a family that plans them: `python -m tests.proof.writing FAMILY --tier T --cases N --seed S …`.

Command line, key, hash and folders are those of tests/concealed: the key's hash is printed and written before the first
recording.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Collection, Sequence
from functools import partial
from pathlib import Path

from tests.concealed.making import make
from tests.proof.families import families, recording_of
from tests.proof.planned import Plan, PlannedFamily


def _plan(name: str, tier: str, index: int, *, seed: int, only: Collection[str]) -> Plan:
    del only
    return _planned(name).plan(tier, index, seed=seed)


def _write(name: str, key: Path, plan: Plan, out: Path) -> None:
    folder = out / plan.id
    folder.mkdir(parents=True, exist_ok=True)
    _planned(name).write(plan, folder, key=key)


def _planned(name: str) -> PlannedFamily:
    family = families()[name]
    assert isinstance(family, PlannedFamily)
    return family


def _is_written(folder: Path) -> bool:
    return recording_of(folder) is not None


def main(arguments: Sequence[str] | None = None) -> int:
    """Plans all cases, seals the key, then writes what is missing."""
    name, *rest = sys.argv[1:] if arguments is None else arguments
    folders = argparse.ArgumentParser(add_help=False)
    folders.add_argument("--out", type=Path)
    folders.add_argument("--key", type=Path)
    given, _ = folders.parse_known_args(rest)
    return make(
        rest, prog=f"python -m tests.proof.writing {name}", about=__doc__, tiers=tuple(_planned(name).full),
        plan=partial(_plan, name), write=partial(_write, name, given.key or given.out), done=_is_written,
    )  # fmt: skip


if __name__ == "__main__":
    sys.exit(main())
