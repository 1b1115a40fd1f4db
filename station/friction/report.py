"""One self-contained HTML page: conclusions, tables and figures of an analysis; images are inside the file."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from string import Template

from station.friction.conclusions import Note, conclusions
from station.friction.figures import FigureKind
from station.friction.report_tables import ReportTable, tables
from station.friction.results import PairResult

_PAGE = Template("""\
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>$title</title>
<style>
body { font: 15px/1.5 system-ui, sans-serif; color: #1a1a1a; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.2rem; margin-top: 2.5rem; } h3 { font-size: 1rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: .85rem; }
caption { text-align: left; font-weight: 600; padding: 1rem 0 .3rem; }
th, td { padding: .2rem .6rem; text-align: right; white-space: nowrap; }
th { border-bottom: 1px solid #888; } td { border-bottom: 1px solid #e4e4e4; }
th:first-child, td:first-child { text-align: left; }
.note, figcaption, footer { color: #555; font-size: .85rem; max-width: 46rem; }
li.finding { color: #a3161a; }
figure { margin: 1.5rem 0; } img { max-width: 100%; height: auto; }
</style>
</head>
<body>
<h1>$title</h1>
<p>$lead</p>
$body
<footer><p>θ is the angle of repose along the slide, |arcsin s_z| with s = R(t, α) s′; µ = tan θ. Runs that ended
without a slide are in no mean. Flagged samples are left out of the means and stay in samples.csv with the names of
their filters.</p></footer>
</body>
</html>
""")

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
    parts += [_figures(result.pair.name, pictures.get(result.pair.name, ())) for result in results]
    return _PAGE.substitute(
        title="Static friction by direction",
        lead=escape(lead + ", ".join(sources) + "."),
        body="\n".join(parts),
    )


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


def _figures(name: str, pictures: Sequence[Picture]) -> str:
    return "\n".join([f"<h2>Figures: {escape(name)}</h2>", *(html_figure(name, picture) for picture in pictures)])


def html_figure(name: str, picture: Picture) -> str:
    """A pair's figure with its caption, the image inside."""
    data = base64.b64encode(picture.png).decode("ascii")
    words = escape(f"{name}: {picture.kind.caption}")
    return (
        f'<figure><img src="data:image/png;base64,{data}" alt="{words}">\n'
        f"<figcaption>{escape(picture.kind.caption)}</figcaption></figure>"
    )
