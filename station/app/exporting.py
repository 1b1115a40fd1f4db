"""Writes the files of an export, and says what they cannot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from shared.errors import UserError
from shared.visible import visible
from station.export import ExportedFile


def write_files(files: Sequence[ExportedFile], folder: Path, *, overwrite: bool) -> None:
    """Writes all files, or none, and prints where they are.

    Raises:
        UserError: if one is there and may not be replaced, or the folder cannot be written to.
    """
    try:
        there = [path for path in (folder / file.name for file in files) if path.exists()]
        if there and not overwrite:
            raise UserError(
                f"Expected to write {there[0]}, but it is there; give --overwrite, or another folder to --out"
            )
        folder.mkdir(parents=True, exist_ok=True)
        for file in files:
            (folder / file.name).write_text(file.text, encoding="utf-8")
    except OSError as error:
        raise UserError(f"Expected to write to the folder {folder}, but that failed: {error.strerror}") from error
    print("\n".join(str(folder / file.name) for file in files))


def print_unsupported(files: Mapping[str, Sequence[ExportedFile]]) -> None:
    """Prints what each pair's, or model's, formats cannot say: each sentence once, with the formats it is about."""
    about: dict[str, dict[str, dict[str, None]]] = {}
    for name, of_format in files.items():
        for file in of_format:
            for sentence in file.unsupported:
                about.setdefault(file.pair, {}).setdefault(sentence, {})[name] = None
    for pair, sentences in about.items():
        print(visible(f"\n{pair}: what the files cannot say"))
        for sentence, names in sentences.items():
            print(visible(f"- {', '.join(names)}: {sentence}"))
