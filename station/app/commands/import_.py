"""Turns other people's measurements into a recording of this format."""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

from shared.arguments import nearest
from shared.errors import UserError
from shared.programs import how_to_call
from shared.rig import load_rig
from station.app.import_check import checked
from station.app.plugins import importer_files, plugin_folders
from station.friction.onset import estimate_onset
from station.recording.importers import Imported, Importer, importers, write
from station.recording.reader import open_recording

NAME = "import"
HELP = "make a recording of measurements in another format (tracks, cube-tosses)"
EXAMPLE = "station import tracks tracks.csv --out tracks.mcap"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    found = importers()
    listed = "; ".join(f"{name}: {found[name].HELP}" for name in sorted(found))
    parser.add_argument("format", help=f"{listed}; or the name of an importer of your own")
    parser.add_argument(
        "file",
        type=Path,
        help="the file to import: github.com/DAIRLab/contact-nets has the tosses, and "
        "station/recording/importers/README.md writes tracks.csv",
    )
    parser.add_argument("--out", type=Path, help="the recording to write (.mcap)")
    parser.add_argument(
        "--check", action="store_true", help="say what the file lacks and which effects cannot be tested without it"
    )
    parser.add_argument("--rig", type=Path, help="your own rig file, whose [plugins] names folders with importers")
    parser.add_argument(
        "--plugins",
        type=Path,
        action="append",
        default=[],
        metavar="FOLDER",
        help="folder with importers of your own (FOLDER/importers/*.py); may be repeated",
    )


def run(args: argparse.Namespace) -> int:
    """Imports, and says what came of it."""
    if args.out is None and not args.check:
        raise UserError("Expected the recording to write (--out FILE.mcap) or --check, got neither")
    imported = _importer(args).read(args.file, onset=estimate_onset)
    for note in imported.notes:
        print(note)
    if args.out is None:
        with tempfile.TemporaryDirectory() as folder:
            _written(imported, Path(folder) / "checked.mcap", check=True)
        return 0
    print(f"{args.out}: {_written(imported, args.out, check=args.check)}")
    station = how_to_call("station")
    print(f"Look at it:  {station} replay {args.out}    Check it:  {station} doctor {args.out}")
    return 0


def _importer(args: argparse.Namespace) -> Importer:
    own = importer_files(plugin_folders(load_rig(args.rig).plugins if args.rig else None, args.plugins))
    found = importers(own)
    if args.format not in found:
        listed = ", ".join(sorted(found))
        raise UserError(f"Expected a format ({listed}), got '{args.format}'{nearest(args.format, found)}")
    return found[args.format]


def _written(imported: Imported, path: Path, *, check: bool) -> str:
    count = write(imported, path)
    reader = open_recording(path)
    if check:
        for line in (*imported.lacking, *checked(reader)):
            print(line)
    return f"{count} messages, {len(reader.samples())} runs, {reader.duration_s:.1f} s"
