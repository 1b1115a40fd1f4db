"""Makes keys for a rig: an authority of its own, and for each process a certificate with the rights of that process.

With them the processes speak over mutual TLS, and each takes from another only what the table of topics says is that
process's own to send, to serve and to ask: the camera agent's keys do not move the arm. Write `tls/…` in the place of
`tcp/…` in [bus], give each machine the folders of its processes, and set REPOSE_KEYS to the folder that holds them.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from shared.bus_rights import ROLES
from shared.rig import load_rig
from station.app.authority import new_authority

NAME = "keys new"
HELP = "make an authority and a certificate for each process of a rig"
EXAMPLE = "station keys new --rig rig.toml --out keys"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument("--rig", type=Path, required=True, help="rig file, whose addresses the certificates are for")
    parser.add_argument("--out", type=Path, default=Path("keys"), metavar="FOLDER", help="a new folder for the keys")


def run(options: argparse.Namespace) -> int:
    """Makes them, and says what goes where; 0."""
    rig = load_rig(options.rig)
    new_authority(rig, options.out)
    print(f"Keys of rig '{rig.id}' for {', '.join(ROLES)}: {options.out}")
    print(
        f"The camera agent's go to the Pi:  deploy/deploy.sh HOST --rig {options.rig} --keys {options.out / 'camera'}"
    )
    print(f"Here:                             export REPOSE_KEYS={options.out.resolve()}")
    print(f"Keep {options.out / 'authority'} to yourself: whoever has it can be any process of the rig.")
    return 0
