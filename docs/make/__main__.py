"""`python -m docs.make reference` writes docs/reference; `python -m docs.make guide FOLDER` the pages of the site."""

from __future__ import annotations

import argparse
from pathlib import Path

from docs.make import guide, reference


def main() -> None:
    """Writes what was asked for."""
    parser = argparse.ArgumentParser(prog="python -m docs.make", description=__doc__)
    kinds = parser.add_subparsers(dest="kind", required=True)
    kinds.add_parser("reference", help="write the reference from the code")
    kinds.add_parser("guide", help="put the site's pages into a folder").add_argument("folder", type=Path)
    options = parser.parse_args()
    if options.kind == "reference":
        reference.write()
    else:
        guide.stage(options.folder)


if __name__ == "__main__":
    main()
