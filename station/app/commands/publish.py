"""Makes a dataset of recordings, ready for Hugging Face, Zenodo or a folder of one's own.

The folder gets data/samples.parquet and data/runs.parquet, the recordings themselves, the figures of each surface pair,
a dataset card (README.md) with provenance, CITATION.cff and provenance.json. Nothing is sent anywhere. The licence has
no default: only the owner of data can give it away. Look at the recordings first: what the camera saw is in them, and
the rig file.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from shared.errors import UserError
from station.app.publishing import Words, publish
from station.publish.citation import author
from station.publish.licence import licence

NAME = "publish"
HELP = "make a dataset of recordings: Parquet, MCAP, card, citation, figures"
EXAMPLE = "station publish session.mcap --out data --license CC0-1.0 --author 'Doe, Jo'"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument("files", type=Path, nargs="+", metavar="FILE", help="recordings (.mcap)")
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER", help="a new folder")
    parser.add_argument("--license", metavar="SPDX", help="identifier of the SPDX list, such as CC-BY-4.0 (needed)")
    parser.add_argument(
        "--author", action="append", default=[], metavar="NAME", help='"Family, Given"; may be repeated (needed)'
    )
    parser.add_argument("--title", default="Static friction on a tilting plate", help="the dataset's title")


def run(options: argparse.Namespace) -> int:
    """Writes the dataset and says where it is."""
    terms = licence(options.license)
    if not options.author:
        raise UserError("Expected --author 'Family, Given', because a dataset without an author cannot be cited")
    words = Words(title=options.title, authors=[author(text) for text in options.author], licence=terms)
    sources = publish(options.files, options.out, words)
    samples = sum(len(source.samples) for source in sources)
    print(f"{samples} samples of {len(sources)} recordings, under {terms.id}: {options.out}")
    print(f"Its card: {options.out / 'README.md'}")
    return 0
