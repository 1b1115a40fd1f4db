"""One self-contained HTML page: conclusions, tables and figures of an analysis; images are inside the file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from shared.notes import note_line
from station.friction.conclusions import Note, conclusions
from station.friction.figures import FigureKind
from station.friction.pairs import Pair
from station.friction.report_tables import ReportTable, tables
from station.friction.results import PairResult
from station.friction.slides import counted
from station.pages import pieces
from station.pages.caption import Caption, command
from station.pages.figure import bitmap
from station.pages.page import whole_page

_STYLE = "th, td { text-align: right; white-space: nowrap; } th:first-child, td:first-child { text-align: left; }"
_TERMS = (
    "θ is the angle of repose along the slide, |arcsin s_z| with s = R(t, α) s′; µ = tan θ. Censored samples, of "
    "runs that ended without a slide, are in no mean. Flagged samples are left out of the means and stay in "
    "samples.csv with the names of their filters."
)
_CLASS = {True: "finding", False: "said"}


@dataclass(frozen=True, slots=True)
class Picture:
    """A figure that was drawn: its kind and the bytes of its PNG."""

    kind: FigureKind
    png: bytes


def html_report(
    results: Sequence[PairResult],
    *,
    sources: Sequence[str],
    pictures: Mapping[str, Sequence[Picture]],
    first: Sequence[ReportTable] = (),
    notes: Sequence[str] = (),
) -> str:
    """Returns the page; `pictures` are by the pair's name.

    The `notes` and the tables `first` stand before everything else.
    """
    samples = sum(len(result.pair.samples) for result in results)
    files = f"{len(sources)} files" if len(sources) > 1 else "1 file"
    lead = f"{samples} samples of {len(results)} surface pair{'s' * (len(results) > 1)} from {files}: "
    parts = [pieces.paragraph(note_line(note)) for note in notes]
    parts += [html_table(table) for table in first]
    parts += [html_conclusions(result.pair.name, conclusions(result)) for result in results]
    parts += [html_table(table) for table in tables(results)]
    parts += [_figures(result.pair, pictures.get(result.pair.name, ())) for result in results]
    title, lead = "Static friction by direction", f"{lead}{', '.join(sources)}."
    body = [f"<h1>{title}</h1>", pieces.paragraph(lead), *parts, pieces.made_with(command(), notes=_TERMS)]
    return whole_page(title=title, body="\n".join(body), style=_STYLE)


def html_conclusions(name: str, notes: Sequence[Note]) -> str:
    """Returns a pair's sentences as a list under its name; findings are marked."""
    items = "\n".join(f'<li class="{_CLASS[note.finding]}">{escape(note.text)}</li>' for note in notes)
    return f"<h2>{escape(name)}</h2>\n<ul>\n{items}\n</ul>"


def html_table(table: ReportTable) -> str:
    """Returns a table with its title and note."""
    rows = [[escape(cell) for cell in row] for row in table.rows]
    return pieces.table(table.columns, rows, caption=table.title, note=table.note)


def _figures(pair: Pair, pictures: Sequence[Picture]) -> str:
    return "\n".join([f"<h2>Figures: {escape(pair.name)}</h2>", *(html_figure(pair, picture) for picture in pictures)])


def html_figure(pair: Pair, picture: Picture) -> str:
    """Returns a pair's figure with its caption, the image inside."""
    return bitmap(picture.png, caption_of(picture.kind, pair), alt=f"{pair.name}: {picture.kind.name}")


def caption_of(kind: FigureKind, pair: Pair) -> Caption:
    """Returns the caption of a pair's figure, with the number of its samples."""
    slid = int(np.count_nonzero(pair.flags.slid))
    kept = int(np.count_nonzero(pair.flags.kept))
    return Caption(
        shows=kind.caption, count=f"{counted(slid)} that slid, of which {kept} were kept", interval=kind.interval
    )
