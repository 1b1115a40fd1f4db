"""The last two sections: what to do next, and where the answer comes from."""

from __future__ import annotations

import math
from html import escape

from station.diagnosis.report import html
from station.diagnosis.report.sentences import next_lines, used
from station.diagnosis.result import Diagnosis
from station.pages import pieces
from station.pages.caption import command


def next_step(diagnosis: Diagnosis) -> str:
    """Returns the next experiment as a plan that `station run --plan` takes, and the model as a file."""
    plan = diagnosis.next_experiment
    first, *commands = next_lines(diagnosis)
    parts = [pieces.paragraph(first), *(f"<p><code>{escape(one.strip())}</code></p>" for one in commands)]
    if plan is not None and plan.plan:
        parts.append(f"<pre>{escape(plan.plan)}</pre>")
    settled = set[str]() if plan is None else {name for group in plan.separates for name in group}
    advice = [
        f"<li>{escape(', '.join(one.class_ids))}: {escape(one.separated_by)}</li>"
        for one in diagnosis.effects
        if one.separated_by and len(one.class_ids) > 1 and not settled & set(one.class_ids)
    ]
    if advice:
        parts.append(f"<p>What separates another class:</p><ul>{''.join(advice)}</ul>")
    return pieces.section("What to do next", *parts, name="next")


def numerics(diagnosis: Diagnosis) -> str:
    """Returns the section on the simulator's numerical artefacts; empty if they were not tested."""
    if not diagnosis.numerics:
        return ""
    rows = [[_cell(one.get(key), to=_last_digit(one["size"])) for key in _NUMERICS] for one in diagnosis.numerics]
    why = "What changes with the simulator's own settings is not physics that it leaves out: cure it first."
    head = ("what", "in words", "size", "unit", "with these settings", "cured", "cured by")
    table = pieces.table(head, rows)
    title = "The simulation's numerics" if diagnosis.given else "Numerics first"
    return pieces.section(title, pieces.paragraph(why), table, name="numerics")


_NUMERICS = ("id", "meant", "size", "unit", "before", "after", "cured_by")


def _last_digit(size: float) -> int:
    """Returns the last of three digits of an artefact's size.

    What is left of it is rounded to it, too: 0.00 and not 6e-14.
    """
    return 2 - math.floor(math.log10(abs(size))) if size and math.isfinite(size) else 2


def _cell(said: object, *, to: int) -> str:
    if isinstance(said, float | int):
        return html.number(round(float(said), to) + 0.0, max(to, 0))
    return "–" if said is None else escape(str(said))


def provenance(diagnosis: Diagnosis, *, seed: int | None) -> str:
    """Returns the section with file, versions, seed, time and notes."""
    rows = [["recording", escape(diagnosis.recording or "signals in memory")]]
    rows.append([diagnosis.counted, f"{used(diagnosis)} used; {diagnosis.held_out_runs} held out"])
    rows.append(["plain simulation", escape(diagnosis.simulator)])
    if seed is not None:
        rows.append(["seed", str(seed)])
    rows.append(["seconds", html.number(diagnosis.seconds, 1)])
    rows += [[escape(name), escape(version)] for name, version in diagnosis.versions.items()]
    rows.append(["command", f"<code>{escape(command())}</code>"])
    rows += [["note", escape(note)] for note in diagnosis.notes]
    return pieces.section("Where this comes from", pieces.table(("", ""), rows), name="provenance")
