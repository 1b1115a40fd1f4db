"""The section on which effects were compared, what is doubtful, and what could not be tested."""

from __future__ import annotations

import math
from html import escape

from station.diagnosis.report import html
from station.diagnosis.report.sentences import in_order
from station.diagnosis.result import Candidates, Diagnosis
from station.pages import pieces

_MOST = 10
_CLASS_ODDS = 6.0


def what(diagnosis: Diagnosis) -> str:
    """The section with the probabilities, a comparison table for each stage, and the effects that cannot be tested."""
    parts = [_probabilities(diagnosis)]
    stages = sorted({row.stage for row in diagnosis.candidates})
    parts += [_comparison(diagnosis, stage) for stage in stages]
    if diagnosis.untestable:
        rows = [[escape(name), escape(why)] for name, why in sorted(diagnosis.untestable.items())]
        parts.append(pieces.table(("effect", "why not"), rows, caption="Untestable with this recording"))
    return pieces.section("What is missing", *parts, name="what")


def _probabilities(diagnosis: Diagnosis) -> str:
    rows = [
        [escape(", ".join(one.class_ids)), escape(one.title), html.number(one.probability), one.verdict, one.side]
        for one in in_order(diagnosis)
    ]
    rows.append(["other", "something outside the catalogue", html.number(diagnosis.other_probability), "", ""])
    right = "the simulation is right" if diagnosis.given else "the plain model is right"
    rows.append(["none", right, html.number(diagnosis.none_probability), "", ""])
    columns = ("effect or class", "in words", "probability", "verdict", "who has it")
    shown = len(columns) if diagnosis.given else len(columns) - 1
    table = pieces.table(columns[:shown], [row[:shown] for row in rows], caption="Posterior probabilities")
    tried = pieces.paragraph(
        f"{diagnosis.candidates_tried} candidates (effects alone and in pairs, smooth places) were tried; that the "
        "best of so many looks good by chance is part of every p."
    )
    return table + tried


def _comparison(diagnosis: Diagnosis, stage: int) -> str:
    rows = [row for row in diagnosis.candidates if row.stage == stage][:_MOST]
    fitted = [row for row in rows if row.fitted]
    if not fitted and stage > 0:
        return pieces.paragraph(f"Stage {stage + 1}: nothing stood out any more.")
    best = max(row.twice_log_odds for row in (fitted or rows))
    # A gain that only a score promises is no evidence yet: such a row has a rank and no weight.
    weights = [math.exp(0.5 * (row.twice_log_odds - best)) if row.fitted or not fitted else 0.0 for row in rows]
    told = [
        _row(diagnosis, row, best=best, weight=weight / sum(weights), rank=place)
        for place, (row, weight) in enumerate(zip(rows, weights, strict=True), start=1)
    ]
    head = ("rank", "candidate", "gain", "parameters", "BIC gain", "2 ln odds", "weight", "class", "doubts")
    caption = f"Stage {stage + 1}: compared with " + ("the plain model" if stage == 0 else "what was found before")
    return pieces.table(head, told, caption=caption)


def _row(diagnosis: Diagnosis, row: Candidates, *, best: float, weight: float, rank: int) -> list[str]:
    return [
        str(rank),
        escape(row.told),
        html.number(row.twice_gain, 1),
        str(row.parameters),
        html.number(row.bic, 1),
        html.number(row.twice_log_odds, 1),
        html.number(weight),
        escape(_class(diagnosis, row)),
        escape(", ".join(_doubts(row, best))),
    ]


def _class(diagnosis: Diagnosis, row: Candidates) -> str:
    """The reported classes that the candidate belongs to."""
    classes = (one.class_ids for one in diagnosis.effects)
    return "; ".join(", ".join(ids) for ids in classes if set(ids) & set(row.ids))


def _doubts(row: Candidates, best: float) -> list[str]:
    doubts: list[str] = []
    if not row.fitted:
        doubts.append("score only, not fitted")
    if row.bic <= 0:
        doubts.append("not worth its parameters")
    elif 0 < best - row.twice_log_odds < _CLASS_ODDS:
        doubts.append("cannot be told from the best")
    return doubts
