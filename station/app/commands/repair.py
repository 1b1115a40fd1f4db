"""Saves what can be read of recordings that broke off or are damaged."""

from __future__ import annotations

import argparse
from pathlib import Path

from shared.errors import UserError
from shared.visible import sentence
from station.recording.repair import repair, repair_folder

NAME = "repair"
HELP = "make a valid recording of one that broke off (FILE.mcap.partial) or is damaged"
EXAMPLE = "station repair killed.mcap.partial"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument("path", type=Path, help="FILE.mcap.partial, a damaged FILE.mcap, or a folder of partial files")
    parser.add_argument("--out", type=Path, help="name of the result; by default FILE.mcap, or FILE.repaired.mcap")


def run(args: argparse.Namespace) -> int:
    """Repairs and says what was saved and what was lost."""
    if not args.path.is_dir():
        print(sentence(repair(args.path, out=args.out).sentence))
        return 0
    if args.out is not None:
        raise UserError(f"Expected --out with a single file, got it with the folder {args.path}")
    done = repair_folder(args.path)
    for repaired in done:
        print(sentence(repaired.sentence))
    if not done:
        print(f"Nothing to repair in {args.path}: no partial recording that can be read and is not being written.")
    return 0
