"""Takes the rights of a process's keys, and gives it new ones.

The other processes learn it from the rights.toml in their folders: copy those to where they run (deploy the camera
agent again), and start the processes anew. Until then they take the old keys.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from shared.bus_rights import ROLES
from shared.rig import load_rig
from station.app.authority import revoke

NAME = "keys revoke"
HELP = "take the rights of a process's keys, and make new ones"
EXAMPLE = "station keys revoke camera --rig rig.toml --keys keys"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument("process", choices=ROLES, help="whose keys are lost")
    parser.add_argument("--rig", type=Path, required=True, help="rig file")
    parser.add_argument("--keys", type=Path, default=Path("keys"), metavar="FOLDER", help="what `keys new` made")


def run(options: argparse.Namespace) -> int:
    """Revokes; 0."""
    fresh = revoke(load_rig(options.rig), options.keys, options.process)
    print(f"New keys for {options.process} ({fresh}) in {options.keys / options.process}; the old ones have no rights.")
    print("Give every process its folder again and start it anew; until then it takes the old keys.")
    return 0
