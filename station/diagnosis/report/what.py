"""The section on which effects were compared, what is doubtful, and what could not be tested."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape

from station.diagnosis import thresholds
from station.diagnosis.report import html
from station.diagnosis.report.sentences import claimed_effects, in_order
from station.diagnosis.result import Candidates, Diagnosis
from station.pages import pieces

_MOST = 10
_HEAD = ("candidate", "gain", "parameters", "BIC gain", "2 ln odds")
_NOTE = (
    "Ranks, shares and assessments are of this stage. The classes, and with them the headline, are decided in the end: "
    "each finding is taken out of the whole model, and all that could stand in its place is compared once more. No law "
    "is exact, so where one gains much, differences of the odds count for less in the shares."
)


def what(diagnosis: Diagnosis) -> str:
    """Returns the section with the probabilities, a comparison table for each stage, and the untestable effects."""
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
    """Returns the stage's candidates that were fitted, by rank, and then those of which only a score is known."""
    rows = [row for row in diagnosis.candidates if row.stage == stage][:_MOST]
    fitted = [row for row in rows if row.fitted]
    if not fitted and stage > 0:
        return pieces.paragraph(f"Stage {stage + 1}: nothing stood out any more.")
    return _fitted(diagnosis, stage, fitted) + _scored(diagnosis, stage, [row for row in rows if not row.fitted])


def _fitted(diagnosis: Diagnosis, stage: int, rows: Sequence[Candidates]) -> str:
    if not rows:
        return ""
    ranked = sorted(rows, key=lambda row: (-row.share, -row.twice_log_odds))
    likelier = [sum(row.share for row in ranked[:rank]) for rank in range(len(ranked))]
    likeliest = {row.ids: row for row in reversed(ranked)}
    words = [
        _assessed(row, before, _found(diagnosis, row), first=likeliest[row.ids] is row)
        for row, before in zip(ranked, likelier, strict=True)
    ]
    cells = [
        [str(rank), *_cells(row), html.number(row.share), _class(diagnosis, row), escape(said)]
        for rank, (row, said) in enumerate(zip(ranked, words, strict=True), start=1)
    ]
    caption = f"Stage {stage + 1}: compared with " + ("the plain model" if stage == 0 else "what was found before")
    return pieces.table(
        ("rank", *_HEAD, "share", "class", "assessment"),
        cells,
        caption=caption,
        note=_NOTE,
    )


def _scored(diagnosis: Diagnosis, stage: int, rows: Sequence[Candidates]) -> str:
    if not rows:
        return ""
    return pieces.table(
        (*_HEAD, "class"),
        [[*_cells(row), _class(diagnosis, row)] for row in rows],
        caption=f"Stage {stage + 1}: not fitted",
        note="These numbers are what scores, to first order, promise of a fit; they have no rank among fitted ones.",
    )


def _cells(row: Candidates) -> list[str]:
    """Returns the cells below `_HEAD`."""
    gain, bic, odds = (html.number(value, 1) for value in (row.twice_gain, row.bic, row.twice_log_odds))
    return [escape(row.label), gain, str(row.parameters), bic, odds]


def _class(diagnosis: Diagnosis, row: Candidates) -> str:
    """Returns the reported classes that the candidate belongs to."""
    classes = (one.class_ids for one in diagnosis.effects)
    return escape("; ".join(", ".join(ids) for ids in classes if set(ids) & set(row.ids)))


def _found(diagnosis: Diagnosis, row: Candidates) -> dict[str, tuple[str, ...]]:
    """Returns the claimed classes by the candidate's own names; a name that was not found has none."""
    classes = [one.class_ids for one in claimed_effects(diagnosis)]
    return {name: next((ids for ids in classes if name in ids), ()) for name in row.ids}


def _assessed(row: Candidates, likelier: float, found: Mapping[str, tuple[str, ...]], *, first: bool) -> str:
    """Returns the assessment of a fitted candidate; `likelier` is the share of those before it, 0 for the best.

    The best and what is needed beside it for the share CREDIBLE cannot be told apart in the stage. `found` has the
    classes in the end by the candidate's names, of which it is the `first` by rank: `other` has several.
    """
    lost = [name for name, ids in found.items() if not ids]
    if likelier < thresholds.CREDIBLE and (row.bic > 0 or not lost):
        here = "indistinguishable from the best" if likelier > 0 else "the likeliest"
        return f"{here} here; without {' and '.join(lost)} in the end" if lost else here
    if first and len(found) == 1 and not lost:
        return "indistinguishable in the end" if len(found[row.ids[0]]) > 1 else "found in the end"
    return "less likely" if row.bic > 0 else "not worth its parameters"
