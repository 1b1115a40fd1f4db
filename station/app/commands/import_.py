"""Turns other people's measurements into a recording of this format."""

from __future__ import annotations

import argparse
from pathlib import Path

from shared.programs import how_to_call
from station.recording.importers import importers, write
from station.recording.reader import open_recording

NAME = "import"
HELP = "make a recording of measurements in another format (cube-tosses, …)"
EXAMPLE = "station import cube-tosses tosses.parquet --out tosses.mcap"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    found = importers()
    listed = "; ".join(f"{name}: {found[name].HELP}" for name in sorted(found))
    parser.add_argument("format", choices=sorted(found), help=listed)
    parser.add_argument("file", type=Path, help="the file to import")
    parser.add_argument("--out", type=Path, required=True, help="the recording to write (.mcap)")


def run(args: argparse.Namespace) -> int:
    """Imports, and says what came of it."""
    imported = importers()[args.format].read(args.file)
    count = write(imported, args.out)
    reader = open_recording(args.out)
    print(f"{args.out}: {count} messages, {len(reader.samples())} runs, {reader.duration_s:.1f} s")
    station = how_to_call("station")
    print(f"Look at it:  {station} replay {args.out}    Check it:  {station} doctor {args.out}")
    return 0
