"""Puts a dataset together: what `station publish` does."""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from shared import installed
from shared.errors import UserError
from station.app.analysis_files import draw_figures
from station.app.foam import free_of_foam_m
from station.app.front.analysis import Analysed, analyze
from station.app.outputs import write_text
from station.pages.caption import made_by
from station.publish.card import TABLES, Card
from station.publish.citation import Author, citation
from station.publish.folder import new_folder
from station.publish.licence import Licence
from station.publish.source import Source, sources_of
from station.publish.tables import runs_table, samples_table
from station.recording.parts import files_of, part_path

FIGURES = ("limit_curve", "polar", "by_direction")
"""The figures that a dataset shows of each pair; `station analyze` draws all."""


@dataclass(frozen=True, kw_only=True)
class Words:
    """The facts that only the dataset's owner can state."""

    title: str
    authors: Sequence[Author]
    licence: Licence


@installed.missing_as_user_error()
def publish(paths: Sequence[Path], out: Path, words: Words) -> tuple[Source, ...]:
    """Writes a dataset of recordings into a new folder; gives what it was made of.

    Raises:
        UserError: if a recording cannot be read or is there twice, there is no sample, or the folder is not new.
    """
    with new_folder(out) as folder:
        sources = sources_of(list(paths))
        found = analyze(list(paths))
        _write_tables(sources, folder / "data")
        _copy(sources, folder / "recordings")
        card = Card(
            title=words.title,
            authors=words.authors,
            licence=words.licence,
            sources=sources,
            figures=_draw(found, folder),
            pairs=dict(found.sentences),
            version=installed.version(),
        )
        _write_texts(card, folder)
    return sources


def _write_tables(sources: Sequence[Source], folder: Path) -> None:
    import pyarrow.parquet as pq  # noqa: PLC0415  # an extra, and slow to load

    folder.mkdir()
    free_m = [free_of_foam_m(source.samples, source.reader.path) for source in sources]
    tables = {"samples": samples_table(sources, free_m), "runs": runs_table(sources)}
    for name in TABLES:
        pq.write_table(tables[name], folder / f"{name}.parquet")


def _copy(sources: Sequence[Source], folder: Path) -> None:
    folder.mkdir()
    for source in sources:
        path = source.reader.path
        try:
            for number, part in enumerate(files_of(path), start=1):
                shutil.copyfile(part, part_path(folder / source.name, number))
        except OSError as error:
            raise UserError(f"Expected to copy {path} to the dataset, but that failed: {error.strerror}") from error


def _draw(found: Analysed, folder: Path) -> list[str]:
    """Draws the figures; gives the pictures' paths below the dataset's folder."""
    figures = folder / "figures"
    figures.mkdir()
    with made_by(found.command):
        for result in found.results:
            draw_figures(result.pair, figures, names=FIGURES)
    return [path.relative_to(folder).as_posix() for path in sorted(figures.glob("*.png"))]


def _write_texts(card: Card, folder: Path) -> None:
    origin = [source.as_json() for source in card.sources]
    texts = {
        "README.md": card.text(),
        "CITATION.cff": citation(title=card.title, authors=card.authors, licence=card.licence, version=card.version),
        "provenance.json": json.dumps(origin, indent=1, ensure_ascii=False) + "\n",
    }
    for name, text in texts.items():
        write_text(folder / name, text, what="dataset")
