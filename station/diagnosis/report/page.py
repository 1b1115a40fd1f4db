"""The whole page: one file with styles and drawings inside, which fetches nothing."""

from __future__ import annotations

from html import escape
from string import Template

from station.diagnosis.report.drawing import style
from station.diagnosis.report.ending import next_step, numerics, provenance
from station.diagnosis.report.fit import fit
from station.diagnosis.report.headline import about, headline
from station.diagnosis.report.picture_data import PictureData
from station.diagnosis.report.what import what
from station.diagnosis.report.where import where
from station.diagnosis.result import Diagnosis

_PAGE = Template("""\
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>$title</title>
<style>
body { font: 15px/1.5 system-ui, sans-serif; color: #1a1a1a; max-width: 64rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.1rem; color: #555; font-weight: 500; } h2 { font-size: 1.25rem; margin-top: 3rem; }
.verdict { font-size: 1.6rem; line-height: 1.3; font-weight: 600; border-left: 6px solid; padding-left: .8rem; }
.yes { border-color: #009e73; } .maybe { border-color: #e69f00; } .no { border-color: #0072b2; }
.cannot { border-color: #d55e00; }
.short { max-width: 50rem; } .about { color: #555; overflow-wrap: anywhere; }
nav a { margin-right: 1rem; }
.whole { white-space: nowrap; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: .85rem; margin: 1rem 0; }
caption { text-align: left; font-weight: 600; padding: .3rem 0; }
th, td { padding: .2rem .7rem; text-align: left; vertical-align: top; }
th { border-bottom: 1px solid #888; white-space: nowrap; } td { border-bottom: 1px solid #e4e4e4; }
figure { margin: 1.5rem 0; overflow-x: auto; } svg { max-width: 100%; height: auto; }
figcaption { color: #555; font-size: .85rem; max-width: 50rem; }
pre { background: #f4f4f4; padding: .8rem; overflow-x: auto; }
@media print { section { break-inside: auto; } figure, table { break-inside: avoid; } }
</style>
</head>
<body>
<h1>Diagnosis: recording against simulation</h1>
$body
</body>
</html>
""")
_LINKS = (("where", "Where"), ("what", "What"), ("fit", "Fit"), ("next", "Next"), ("provenance", "Provenance"))


def html_page(diagnosis: Diagnosis, pictures: PictureData, *, seed: int | None = None) -> str:
    """The report as HTML; `seed` is listed in its provenance."""
    links = "".join(f'<a href="#{name}">{word}</a>' for name, word in _LINKS)
    with style():
        parts = [about(diagnosis), headline(diagnosis), f"<nav>{links}</nav>"]
        if diagnosis.verdict != "untestable":
            told = [where(diagnosis, pictures), what(diagnosis)]
            # What the user's own simulation does by its numerics comes after what it leaves out; ours is cured first.
            parts += [*told, numerics(diagnosis)] if diagnosis.given else [numerics(diagnosis), *told]
            parts.append(fit(diagnosis, pictures))
        else:
            parts.append(what(diagnosis))
        parts += [next_step(diagnosis), provenance(diagnosis, seed=seed)]
    return _PAGE.substitute(title=escape(f"Diagnosis of {diagnosis.recording or 'a recording'}"), body="\n".join(parts))
