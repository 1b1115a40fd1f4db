"""The whole page: one file with styles and drawings inside, which fetches nothing."""

from __future__ import annotations

from station.diagnosis.report.ending import next_step, numerics, provenance
from station.diagnosis.report.fit import fit
from station.diagnosis.report.headline import about, headline
from station.diagnosis.report.picture_data import PictureData
from station.diagnosis.report.what import what
from station.diagnosis.report.where import where
from station.diagnosis.result import Diagnosis
from station.pages.caption import command, command_line, made_by
from station.pages.drawing import style
from station.pages.page import whole_page

_STYLE = """\
h1 { font-size: 1.1rem; color: var(--faint); font-weight: 500; } h2 { margin-top: 3rem; }
.verdict { font-size: 1.6rem; line-height: 1.3; font-weight: 600; border-left: 6px solid; padding-left: .8rem; }
.yes { border-color: #009e73; } .maybe { border-color: #e69f00; } .no { border-color: #0072b2; }
.cannot { border-color: #d55e00; }
.short { max-width: 50rem; } .about { color: var(--faint); overflow-wrap: anywhere; }
nav a { margin-right: 1rem; } .whole { white-space: nowrap; }
th, td { text-align: left; } th { white-space: normal; }"""
_LINKS = (("where", "Where"), ("what", "What"), ("fit", "Fit"), ("next", "Next"), ("provenance", "Provenance"))


def html_page(diagnosis: Diagnosis, pictures: PictureData, *, seed: int | None = None, motion: str = "") -> str:
    """Returns the report as HTML; `seed` is listed in its provenance, `motion` is a figure of one run that moves.

    Figures name the command of `made_by`, or else the one that diagnoses the recording with this seed.
    """
    links = "".join(f'<a href="#{name}">{word}</a>' for name, word in _LINKS)
    usual = command_line("station", "diagnose", diagnosis.recording, seed=seed, report="page.html")
    with style(), made_by(command(usual)):
        parts = [about(diagnosis), headline(diagnosis), f"<nav>{links}</nav>"]
        if diagnosis.verdict != "untestable":
            sections = [where(diagnosis, pictures), what(diagnosis)]
            # Numerics of the user's own simulation come after the physics that it leaves out; ours is cured first.
            parts += [*sections, numerics(diagnosis)] if diagnosis.given else [numerics(diagnosis), *sections]
            parts += [fit(diagnosis, pictures), motion]
        else:
            parts.append(what(diagnosis))
        parts += [next_step(diagnosis), provenance(diagnosis, seed=seed)]
    title = f"Diagnosis of {diagnosis.recording or 'a recording'}"
    body = ["<h1>Diagnosis: recording against simulation</h1>", *parts]
    return whole_page(title=title, body="\n".join(body), style=_STYLE)
