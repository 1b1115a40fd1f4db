"""One self-contained HTML page: conclusions, tables and figures of an analysis; images are inside the file."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from station.friction.conclusions import Note, conclusions
from station.friction.figures import FigureKind
from station.friction.pairs import Pair
from station.friction.report_tables import ReportTable, tables
from station.friction.results import PairResult
from station.friction.slides import counted
from station.pages.page import whole_page

_STYLE = "th, td { text-align: right; white-space: nowrap; } th:first-child, td:first-child { text-align: left; }"
_FOOTER = """\
<footer><p>θ is the angle of repose along the slide, |arcsin s_z| with s = R(t, α) s′; µ = tan θ. Runs that ended
without a slide are in no mean. Flagged samples are left out of the means and stay in samples.csv with the names of
their filters.</p><p>Made by <code>$command</code></p></footer>"""

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
) -> str:
    """The page; `pictures` are by the pair's name. The tables `first` stand before everything else."""
    samples = sum(len(result.pair.samples) for result in results)
    files = f"{len(sources)} files" if len(sources) > 1 else "1 file"
    lead = f"{samples} samples of {len(results)} surface pair{'s' * (len(results) > 1)} from {files}: "
    parts = [html_table(table) for table in first]
    parts += [html_conclusions(result.pair.name, conclusions(result)) for result in results]
    parts += [html_table(table) for table in tables(results)]
    parts += [_figures(result.pair, pictures.get(result.pair.name, ())) for result in results]
    title, command = "Static friction by direction", escape(f"station analyze {' '.join(sources)}")
    lead = escape(f"{lead}{', '.join(sources)}.")
    body = [f"<h1>{title}</h1>", f"<p>{lead}</p>", *parts, _FOOTER.replace("$command", command)]
    return whole_page(title=title, body="\n".join(body), style=_STYLE)


def html_conclusions(name: str, notes: Sequence[Note]) -> str:
    """A pair's sentences as a list under its name; findings are marked."""
    items = "\n".join(f'<li class="{_CLASS[note.finding]}">{escape(note.text)}</li>' for note in notes)
    return f"<h2>{escape(name)}</h2>\n<ul>\n{items}\n</ul>"


def html_table(table: ReportTable) -> str:
    """A table with its title and note."""
    head = "".join(f"<th>{escape(column)}</th>" for column in table.columns)
    rows = "\n".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in table.rows)
    note = f'<p class="note">{escape(table.note)}</p>' if table.note else ""
    caption = f"<caption>{escape(table.title)}</caption>"
    return (
        f'<div class="wide"><table>{caption}\n<thead><tr>{head}</tr></thead>\n<tbody>{rows}</tbody></table></div>{note}'
    )


def _figures(pair: Pair, pictures: Sequence[Picture]) -> str:
    return "\n".join([f"<h2>Figures: {escape(pair.name)}</h2>", *(html_figure(pair, picture) for picture in pictures)])


def html_figure(pair: Pair, picture: Picture) -> str:
    """A pair's figure with its caption and the number of its slides, the image inside."""
    data = base64.b64encode(picture.png).decode("ascii")
    slides = int(np.count_nonzero(pair.flags.slid))
    number = f"n = {counted(slides)}, of which {int(np.count_nonzero(pair.flags.kept))} passed the filters."
    return (
        f'<figure><img src="data:image/png;base64,{data}" alt="{escape(f"{pair.name}: {picture.kind.caption}")}">\n'
        f"<figcaption>{escape(f'{picture.kind.caption} {number}')}</figcaption></figure>"
    )
