"""The command: `python -m tests.proof.patch_world --out FOLDER --tier T --cases N --seed S` (README.md)."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from shared.errors import UserError
from tests.proof.patch_world.cases import TIERS
from tests.proof.patch_world.effects import EFFECTS
from tests.proof.patch_world.making import KEY, Order, make, seal


def main(arguments: list[str] | None = None) -> int:
    """Makes the cases; 0, or 2 for an order that cannot be met."""
    parser = argparse.ArgumentParser(prog="python -m tests.proof.patch_world", description=__doc__)
    parser.add_argument(
        "--out", type=Path, required=True, help="folder of the cases; a call that broke off goes on there"
    )
    parser.add_argument("--tier", choices=TIERS, required=True, help="what the cases conceal")
    parser.add_argument("--cases", type=int, required=True, help="how many")
    parser.add_argument("--seed", type=int, required=True, help="of every draw; the same arguments make the same bytes")
    parser.add_argument("--runs", type=int, default=120, help="runs of a session (120)")
    parser.add_argument("--jobs", type=int, default=1, help="processes (1)")
    parser.add_argument("--key", type=Path, metavar="FOLDER", help="of the key and the truth, if not beside the cases")
    parser.add_argument("--only", default="", help=f"choose from these effects only: {', '.join(EFFECTS)}")
    options = parser.parse_args(arguments)
    try:
        order = _order(options)
        print(f"Sealed: {seal(order, jobs=options.jobs)}  {order.keys / KEY}", flush=True)
        make(order, jobs=options.jobs, tell=lambda line: print(line, flush=True))
    except UserError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


def _order(options: argparse.Namespace) -> Order:
    only = tuple(filter(None, options.only.split(",")))
    if unknown := [one for one in only if one not in EFFECTS]:
        raise UserError(f"Expected effects of the patch world as --only, got {', '.join(unknown)}")
    if options.tier == "pair" and len(set(only)) == 1:
        raise UserError(f"Expected two effects or more as --only of a pair, got {only[0]}; name another one")
    if min(options.cases, options.runs) < 1 or options.seed < 0:
        raise UserError("Expected --cases and --runs of 1 or more and a --seed of 0 or more")
    return Order(
        out=options.out, key=options.key, tier=options.tier, cases=options.cases, seed=options.seed, runs=options.runs,
        only=only,
    )  # fmt: skip


if __name__ == "__main__":
    sys.exit(main())
