"""Writes measured friction for simulators: MuJoCo, Gazebo, Bullet, Drake, USD physics, or as plain JSON and CSV.

Every surface pair gets files of its own in the folder of --out: a small scene with plate and object that the simulator
loads as it stands, with the friction in it to be copied elsewhere. Simulators combine the coefficients of two materials
each in its own way (the larger, the smaller, mean, harmonic mean, product); the files hold what makes each of them read
the measured value. What a format cannot say (one-way friction, scatter, directions) stands in the file as a comment and
is printed. station/export/README.md has the figures: how far each simulator's tilt test is from the measurement.

Exit status: 0; 1 when a pair could not be exported (a sentence says why); 2 for a mistake in what was asked.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from shared.errors import UserError
from station.app.sessions import read_session
from station.export import ExportedFile, Format, export, export_formats
from station.export.from_samples import pair_of_slides
from station.export.materials import RULES, shared_materials
from station.export.measured import MeasuredPair
from station.export.reading import read_pairs
from station.friction.pairs import pairs_of

NAME = "export"
HELP = "write measured friction for MuJoCo, Gazebo, Bullet, Drake, USD, JSON or CSV"
EXAMPLE = "station export sim.mcap --format all --out models"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    formats = "; ".join(f"{name}: {each.HELP}" for name, each in sorted(export_formats().items()))
    parser.add_argument(
        "files",
        type=Path,
        nargs="+",
        metavar="FILE",
        help="limit_curves.json of `station analyze`, friction_pairs.json of an earlier export, recordings (.mcap), or "
        "tables of samples (.csv, .parquet)",
    )
    parser.add_argument(
        "--format",
        default="json",
        metavar="FORMAT[,FORMAT]",
        help=f"one or more, parted by commas, or 'all'. {formats}".replace("%", "%%"),
    )
    parser.add_argument("--out", type=Path, default=Path("export"), metavar="FOLDER", help="where the files go")
    parser.add_argument("--overwrite", action="store_true", help="replace files that are there")
    parser.add_argument("--seed", type=int, default=1, help="seed of the fits' checks")


def run(options: argparse.Namespace) -> int:
    """Exports; 0 when every pair could be, 1 when not."""
    formats = _formats(options.format)
    pairs, refused = _measured(options.files, seed=options.seed)
    for sentence in refused:
        print(sentence)
    if not pairs:
        raise UserError(f"Expected friction to export in {_listed(options.files)}, but there is none")
    files = {each.NAME: export(pairs, each) for each in formats}
    _write([file for of_format in files.values() for file in of_format], options.out, overwrite=options.overwrite)
    _tell(files)
    if len(pairs) > 1:
        _tell_shared(pairs)
    return 1 if refused else 0


def _formats(words: str) -> list[Format]:
    known = export_formats()
    names = list(dict.fromkeys(word.strip() for word in words.split(",")))
    chosen = sorted(known) if "all" in names else names
    if unknown := [name for name in chosen if name not in known]:
        raise UserError(f"Expected --format to be 'all' or of {', '.join(sorted(known))}, got '{unknown[0]}'")
    return [known[name] for name in chosen]


# --- reading ----------------------------------------------------------------------------------------------------------


def _measured(paths: Sequence[Path], *, seed: int) -> tuple[list[MeasuredPair], list[str]]:
    """The pairs of all files, and sentences about those that have no friction to export."""
    curves = [read_pairs(path) for path in paths if path.suffix == ".json"]
    sessions = [read_session(path) for path in paths if path.suffix != ".json"]
    rng = np.random.default_rng(seed)
    found = [pair for each in curves for pair in each.pairs]
    refused = [sentence for each in curves for sentence in each.refused]
    for pair in pairs_of(sessions):
        if measured := pair_of_slides(pair, rng=rng):
            found.append(measured)
        else:
            refused.append(f"{pair.name} has no kept slide, so there is no friction to export.")
    return found, refused


def _listed(paths: Sequence[Path]) -> str:
    return ", ".join(str(path) for path in paths)


# --- writing and telling ----------------------------------------------------------------------------------------------


def _write(files: Sequence[ExportedFile], folder: Path, *, overwrite: bool) -> None:
    for file in files:
        path = folder / file.name
        if path.exists() and not overwrite:
            raise UserError(f"Expected to write {path}, but it is there; give --overwrite, or another folder to --out")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for file in files:
            (folder / file.name).write_text(file.text, encoding="utf-8")
    except OSError as error:
        raise UserError(f"Expected to write to the folder {folder}, but that failed: {error.strerror}") from error
    print("\n".join(str(folder / file.name) for file in files))


def _tell(files: Mapping[str, Sequence[ExportedFile]]) -> None:
    """What each pair's formats cannot say: each sentence once, with the formats that it is about."""
    about: dict[str, dict[str, dict[str, None]]] = {}
    for name, of_format in files.items():
        for file in of_format:
            for sentence in file.unsaid:
                about.setdefault(file.pair, {}).setdefault(sentence, {})[name] = None
    for pair, sentences in about.items():
        print(f"\n{pair}: what the files cannot say")
        for sentence, names in sentences.items():
            print(f"- {', '.join(names)}: {sentence}")


def _tell_shared(pairs: Sequence[MeasuredPair]) -> None:
    print("\nEach file's materials hold for its own pair. In one scene, with one coefficient a material:")
    for rule in RULES:
        shared = shared_materials(rule, pairs)
        values = ", ".join(f"{name} {mu:.4f}" for name, mu in shared.mu.items())
        degrees = np.degrees(shared.misread_rad)
        off = "exact" if degrees < 0.005 else f"off by {degrees:.2f} degrees for {shared.worst}"
        print(f"- {rule}: {values} ({off})")
