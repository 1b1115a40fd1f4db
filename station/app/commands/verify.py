"""Derives again what a recording says was derived, and says whether it is identical, or where it is not.

Corners of the block and of the plate's fiducials are read again from the recorded pictures, where there are any; the
plate's attitudes follow once more from the joints, and commands, events and samples from the recorded messages, with
the plan and the rig inside the recording. A signature beside it (`station keys sign`) says who made it. What no picture
shows, and what follows from that, can be forged without a trace in an unsigned file.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from shared.visible import visible
from station.app.signature import Signature, keys_folder, signature_line
from station.app.verifying import Verification, verify

NAME = "verify"
HELP = "derive a recording's corners, attitudes, decisions and samples again: identical, or where not? who signed it?"
EXAMPLE = "station verify sim.mcap"
ONE = "something differs from what follows from the recording, a signature does not hold, or nothing could be derived"
_SIGNS = {"identical": "✓", "different": "✗", "not derived": "–"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument("file", type=Path, help="a recording (.mcap)")
    parser.add_argument(
        "--keys", type=Path, metavar="FOLDER", help="the rig's keys, which say whose signature counts (or REPOSE_KEYS)"
    )
    parser.add_argument("--json", action="store_true", help="print everything as JSON")


def run(options: argparse.Namespace) -> int:
    """Returns 0 when everything that can be derived is identical and no signature is broken, 1 otherwise."""
    found = verify(options.file, keys=keys_folder(options.keys))
    if options.json:
        print(json.dumps(found.as_json(), indent=2, allow_nan=False))
    else:
        _print(found)
    return 0 if found.holds else 1


def _print(found: Verification) -> None:
    for part in found.parts:
        print(visible(f"{_SIGNS[part.state]} {part.name:<10}{part.state}: {part.sentence}"))
    print(visible(f"{_signed(found.signature)} {'signature':<10}{signature_line(found.signature)}"))
    print(f"  sha256    {found.sha256}")
    if found.first is not None:
        print(visible(f"First difference: {found.first}"))


def _signed(signature: Signature | None) -> str:
    """Returns the sign of a signature; one that anybody's key may have made says as little as none."""
    if signature is None or not (signature.fault or signature.authority):
        return "–"
    return "✗" if signature.fault else "✓"
