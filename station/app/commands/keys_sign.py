"""Signs a recording with the station's key: FILE.mcap.sig beside it says who made it, and that nobody changed it.

`station run` does it by itself at the end of a session where REPOSE_KEYS names the rig's keys. `station verify` reads
it.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from shared.errors import UserError
from station.app.signature import keys_folder
from station.app.signing import sign
from station.recording.reader import open_recording

NAME = "keys sign"
HELP = "sign a recording with the rig's key (FILE.mcap.sig); `station verify` says who signed it"
EXAMPLE = "station keys sign session.mcap --keys keys"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument("file", type=Path, help="a recording (.mcap)")
    parser.add_argument("--keys", type=Path, metavar="FOLDER", help="what `keys new` made (or REPOSE_KEYS)")


def run(options: argparse.Namespace) -> int:
    """Signs; 0."""
    keys = keys_folder(options.keys)
    if keys is None:
        raise UserError("Expected the folder of the rig's keys: give --keys FOLDER, or set REPOSE_KEYS")
    open_recording(options.file)  # a recording that cannot be read is not worth a signature
    print(f"Signed: {sign(options.file, keys, now_ns=time.time_ns())}")
    return 0
