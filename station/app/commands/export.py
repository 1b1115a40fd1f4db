"""Writes friction for simulators: what was measured as scenes, a model of `station diagnose` as code.

Measured friction goes to MuJoCo, Gazebo, Bullet, Drake, USD physics, or plain JSON and CSV.

Every surface pair gets files of its own in the folder of --out: a small scene with plate and object that the simulator
loads as it stands, with the friction in it to be copied elsewhere. Simulators combine the coefficients of two materials
each in its own way (the larger, the smaller, mean, harmonic mean, product); the files hold what makes each of them read
the measured value. What a format cannot say (one-way friction, scatter, directions) stands in the file as a comment and
is printed. station/export/README.md has the figures: how far each simulator's tilt test is from the measurement.

A model (model.toml, as `station diagnose --model` writes it) becomes a file of Python that runs it in an engine without
this package: numpy, mujoco-python, pybullet, drake. Where friction by direction is all that it says, the scenes above
say it, too. With --compare each file is run in its engine, and its distance from our own simulation is printed.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from shared.arguments import nearest, seed_of
from shared.errors import UserError
from shared.notes import note_line
from shared.visible import visible
from station.app import exported_model
from station.app.analysing import notes_of
from station.app.exporting import print_unsupported, write_files
from station.app.sentences import print_sentence
from station.app.sessions import read_session
from station.export import Format, ModelFormat, export, export_formats, model_formats
from station.export.from_samples import pair_of_slides
from station.export.materials import RULES, shared_materials
from station.export.measured import MeasuredPair
from station.export.reading import read_pairs
from station.friction.pairs import Session, pairs_of

NAME = "export"
HELP = "write measured friction, or a model, for MuJoCo, Gazebo, Bullet, Drake, USD, NumPy, JSON or CSV"
EXAMPLE = "station export sim.mcap --format all --out models"
ONE = "a pair could not be exported, or a model not in all formats"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    formats, of_model = (_described(known) for known in (export_formats(), model_formats()))
    parser.add_argument(
        "files",
        type=Path,
        nargs="+",
        metavar="FILE",
        help="limit_curves.json of `station analyze`, friction_pairs.json of an earlier export, recordings (.mcap), "
        "tables of samples (.csv, .parquet), or one model.toml of `station diagnose`",
    )
    parser.add_argument(
        "--format",
        metavar="FORMAT[,FORMAT]",
        help=f"one or more, parted by commas, or 'all'. Measured friction (default json): {formats}. "
        f"A model (default {exported_model.DEFAULT}): {of_model}".replace("%", "%%"),
    )
    parser.add_argument("--out", type=Path, default=Path("export"), metavar="FOLDER", help="where the files go")
    parser.add_argument("--overwrite", action="store_true", help="replace files that are there")
    parser.add_argument("--seed", type=seed_of, default=1, help="seed of the fits' checks")
    parser.add_argument("--rig", type=Path, help="rig file that names folders of effects of your own, for a model")
    parser.add_argument(
        "--compare", action="store_true", help="run a model's files in their engines; print how far they are from ours"
    )


def run(options: argparse.Namespace) -> int:
    """Exports; 0 when every pair could be, 1 when not."""
    if any(path.suffix == ".toml" for path in options.files):
        return _export_model(options)
    formats = _formats(options.format or "json")
    sessions = [read_session(path) for path in options.files if path.suffix != ".json"]
    pairs, refused = _measured(options.files, sessions, seed=options.seed)
    for sentence in refused:
        print(visible(sentence))
    if not pairs:
        raise UserError(f"Expected friction to export in {_listed(options.files)}, but there is none")
    files = {each.NAME: export(pairs, each) for each in formats}
    write_files([file for of_format in files.values() for file in of_format], options.out, overwrite=options.overwrite)
    print_unsupported(files)
    if len(pairs) > 1:
        _tell_shared(pairs)
    for note in notes_of(sessions):
        print()
        print_sentence(note_line(note))
    return 1 if refused else 0


def _described(known: Mapping[str, Format | ModelFormat]) -> str:
    return "; ".join(f"{name}: {each.HELP}" for name, each in sorted(known.items()))


def _export_model(options: argparse.Namespace) -> int:
    files: list[Path] = options.files
    if len(files) > 1:
        raise UserError(f"Expected one model.toml and nothing beside it, got {_listed(files)}")
    names = _names(options.format or exported_model.DEFAULT, exported_model.known_formats())
    return exported_model.run(
        files[0], names, out=options.out, rig=options.rig, overwrite=options.overwrite, compare=options.compare
    )


def _formats(words: str) -> list[Format]:
    known = export_formats()
    names = _names(words, sorted(known))
    return [known[name] for name in (sorted(known) if "all" in names else names)]


def _names(words: str, known: Sequence[str]) -> list[str]:
    names = list(dict.fromkeys(word.strip() for word in words.split(",")))
    if unknown := [name for name in names if name not in (*known, "all")]:
        raise UserError(
            f"Expected --format to be 'all' or of {', '.join(known)}, got '{unknown[0]}'{nearest(unknown[0], known)}"
        )
    return names


# --- reading ----------------------------------------------------------------------------------------------------------


def _measured(paths: Sequence[Path], sessions: Sequence[Session], *, seed: int) -> tuple[list[MeasuredPair], list[str]]:
    """Returns the pairs of all files, and sentences about those that have no friction to export."""
    curves = [read_pairs(path) for path in paths if path.suffix == ".json"]
    rng = np.random.default_rng(seed)
    found = [pair for each in curves for pair in each.pairs]
    refused = [sentence for each in curves for sentence in each.refused]
    for pair in pairs_of(sessions):
        if measured := pair_of_slides(pair, rng=rng):
            found.append(measured)
        else:
            refused.append(f"{pair.name} has no kept sample, so there is no friction to export.")
    return found, refused


def _listed(paths: Sequence[Path]) -> str:
    return ", ".join(str(path) for path in paths)


def _tell_shared(pairs: Sequence[MeasuredPair]) -> None:
    print("\nEach file's materials hold for its own pair. In one scene, with one coefficient a material:")
    for rule in RULES:
        shared = shared_materials(rule, pairs)
        values = ", ".join(f"{name} {mu:.4f}" for name, mu in shared.mu.items())
        degrees = np.degrees(shared.misread_rad)
        off = "exact" if degrees < 0.005 else f"off by {degrees:.2f} degrees for {shared.worst}"
        print(visible(f"- {rule}: {values} ({off})"))
