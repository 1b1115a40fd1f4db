"""Writes a recording in the format of other tools. The recording stays as it is."""

from __future__ import annotations

import argparse
from pathlib import Path

from shared.errors import UserError
from shared.installed import missing_as_user_error
from station.recording.converters import converters
from station.recording.reader import open_recording

NAME = "convert"
HELP = "write a recording in the format of other tools (a bag of ROS 2)"
EXAMPLE = "station convert session.mcap --to rosbag2 --out session-ros2"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    found = converters()
    parser.add_argument("file", type=Path, help="the recording (.mcap)")
    parser.add_argument(
        "--to", choices=sorted(found), required=True, help="; ".join(f"{name}: {found[name].HELP}" for name in found)
    )
    parser.add_argument("--out", type=Path, metavar="OUT", help="what to write; by default beside it, as FILE-FORMAT")


@missing_as_user_error()
def run(args: argparse.Namespace) -> int:
    """Converts, and says how many messages of each topic there are."""
    out: Path = args.out or args.file.with_name(f"{args.file.stem}-{args.to}")
    if out.exists():
        raise UserError(f"Expected to write to a new place, but {out} is there; give another --out, or remove it")
    converted = converters()[args.to].convert(open_recording(args.file), out)
    for topic, (kind, count) in converted.written.items():
        print(f"{count:8}  {topic:28} {kind}")
    for topic, count in converted.left_out.items():
        print(f"{count:8}  {topic:28} left out: {args.to} has no such type")
    print(f"{out}: {sum(count for _, count in converted.written.values())} messages")
    return 0
