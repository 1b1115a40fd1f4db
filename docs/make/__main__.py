"""Writes what the documentation site is made of: the reference from the code, and all pages into a folder."""

from __future__ import annotations

import argparse
import tomllib
from pathlib import Path

from docs.make import guide, reference


def main() -> None:
    """Writes what was asked for."""
    parser = argparse.ArgumentParser(prog="python -m docs.make", description=__doc__)
    kinds = parser.add_subparsers(dest="kind", required=True)
    kinds.add_parser("reference", help="write the reference from the code")
    kinds.add_parser("guide", help="put the site's pages into a folder").add_argument("folder", type=Path)
    kinds.add_parser("needs", help="print the packages that build the site, for pip")
    options = parser.parse_args()
    if options.kind == "reference":
        reference.write()
    elif options.kind == "guide":
        guide.stage(options.folder)
    else:
        print("\n".join(needs()))


def needs() -> list[str]:
    """The dependency group `docs`, which an older pip cannot read by itself."""
    project = tomllib.loads((guide.ROOT / "pyproject.toml").read_text("utf-8"))
    return project["dependency-groups"]["docs"]


if __name__ == "__main__":
    main()
