"""The section on how much better the simulation fits with what was found."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

import numpy as np

from station.diagnosis.report import html
from station.diagnosis.report.onsets import onsets
from station.diagnosis.report.picture_data import PictureData
from station.diagnosis.report.scores import scores
from station.diagnosis.report.sentences import as_expected, own_level, singular
from station.diagnosis.result import Diagnosis, FitQuality, Quality, read_name
from station.pages import pieces
from station.pages.caption import Caption
from station.pages.figure import drawn


def fit(diagnosis: Diagnosis, pictures: PictureData) -> str:
    """Returns the section with before, after and floor on held-out runs, the onsets' errors, and the parameters."""
    parts = [_table(diagnosis)]
    before, after = pictures.held_before, pictures.held_after
    if before is not None and after is not None:
        shown = scores(diagnosis, pictures)
        parts.append(drawn(shown, _of_scores(diagnosis), name="scores", alt="before, after and floor"))
        known = int(np.isfinite(before.onset_error_deg).sum())
        if known > 1:
            shown = onsets(before, after, both=bool(diagnosis.names), counted=diagnosis.counted)
            parts.append(drawn(shown, _of_onsets(known), name="onsets", alt="errors of the onsets"))
    parts.append(_parameters(diagnosis))
    return pieces.section("How much better it fits", *parts, name="fit")


def _of_scores(diagnosis: Diagnosis) -> Caption:
    return Caption(
        shows="Errors of predictions before and after what was found is put into the simulation. Dashed in the first "
        f"panel, the floor: how far equal {diagnosis.counted} are apart; dashed at 0.9: what is due.",
        count=f"{diagnosis.used_runs} held-out {diagnosis.counted}",
        interval="bars: 90 % intervals",
    )


def _of_onsets(known: int) -> Caption:
    return Caption(
        shows="Left: errors of the predicted onsets. Middle: recorded quantiles against those of the predicted spread "
        "(on the line: right). Right: ranks in the predicted distribution (within the band: right).",
        count=f"{known} held-out onsets",
        interval="band: holds nine bins of ten",
    )


def _table(diagnosis: Diagnosis) -> str:
    fit = diagnosis.fit
    errors = [f"{one}: rms, median" for one in ("onset error (°)", "path error (mm)", "yaw error (°)")]
    head = (
        f"unseen {diagnosis.counted}",
        f"log score a {singular(diagnosis)}",
        *errors,
        "within 90\N{NO-BREAK SPACE}%",
    )
    plain = "the given simulation" if diagnosis.given else "plain model"
    rows = [_quality(f"before: {plain}", fit.before), _quality("after: with what was found", fit.after)]
    rows.append(["ceiling: sessions drawn from the fit", html.number(fit.ceiling_log_score), "", "", "", ""])
    rows.append([f"floor: equal {diagnosis.counted}", "", html.number(fit.floor_onset_deg), "", "", ""])
    rows += _rerun(fit.simulator_rerun)
    gain = (
        f"Log score gained: {html.number(fit.log_score_gain, sign=True)} ± {html.number(fit.gain_se)} "
        f"a {singular(diagnosis)}{_expected(fit)}. {_unseen(diagnosis)}"
    )
    return pieces.table(head, rows, caption="Before and after") + pieces.paragraph(gain)


def _unseen(diagnosis: Diagnosis) -> str:
    """Returns the sentence that tells what of a fit knows nothing of the runs that it predicts."""
    apart = f"without the {diagnosis.counted} that are predicted"
    if diagnosis.fit.nested:
        return f"Names and numbers were found {apart}."
    return f"Numbers were fitted {apart}; the names were found with all {diagnosis.counted} (--nested searches anew)."


def _expected(fit: FitQuality) -> str:
    """Returns the gain beside that of sessions drawn from the model.

    It is empty where the plain model leaves nothing to gain.
    """
    if not np.isfinite(fit.gap_closed):
        return ""
    ratio = f"{html.number(fit.gap_closed)} ± {html.number(fit.gap_closed_se)}"
    return f", {as_expected(ratio)}; that is the ceiling, of sessions that are drawn from the model itself"


def _quality(name: str, quality: Quality) -> list[str]:
    return [name, *_in_cells({one: f"{html.number(getattr(quality, one))}{_se(quality, one)}" for one in _FIGURES})]


_ERRORS = (
    ("onset_rmse_deg", "onset_median_deg"),
    ("path_rmse_mm", "path_median_mm"),
    ("turn_rmse_deg", "turn_median_deg"),
)
_FIGURES = ("log_score", *(name for both in _ERRORS for name in both), "coverage90")


def _in_cells(figures: Mapping[str, str]) -> list[str]:
    """Returns the figures as cells of a row.

    Root mean square and median of each error stand in one, where lines may break.
    """
    unbroken = {name: html.whole(figure) for name, figure in figures.items()}
    errors = [", ".join(unbroken[name] for name in both) for both in _ERRORS]
    return [unbroken["log_score"], *errors, unbroken["coverage90"]]


def _se(quality: Quality, figure: str) -> str:
    se = quality.se.get(figure, float("nan"))
    return f" ± {html.number(se)}" if np.isfinite(se) else ""


def _rerun(rerun: Mapping[str, Any]) -> list[list[str]]:
    """Returns rows with the quality of another simulator before and after, if it was run."""
    rows: list[list[str]] = []
    for when in ("before", "after"):
        said: Mapping[str, Any] = rerun.get(when) or {}
        if said:
            rows.append([escape(f"{rerun.get('engine', '')}, {when}"), *_cells(said)])
        if said.get("own_level") and own_level(rerun):
            name = f"{rerun.get('engine', '')}, {when}, {own_level(rerun)}"
            rows.append([escape(name), *_cells(said["own_level"])])
    return rows


def _cells(said: Mapping[str, Any]) -> list[str]:
    return _in_cells({name: f"{_plain(said.get(name))}{_error(said, name)}" for name in _FIGURES})


def _error(said: Mapping[str, Any], name: str) -> str:
    se = said.get("se", {}).get(name)
    return "" if se is None else f" ± {html.number(float(se))}"


def _plain(value: float | None) -> str:
    return html.number(float("nan") if value is None else float(value))


def _parameters(diagnosis: Diagnosis) -> str:
    rows = [["plain model", diagnosis.level, *html.with_error(diagnosis.mu_s)]]
    rows.append(["plain model", "scatter", html.number(diagnosis.scatter, 3), "–", f"of {diagnosis.level}"])
    for effect in diagnosis.effects:
        rows += [
            [escape(effect.id), escape(read_name(name, value.unit)), *html.with_error(value)]
            for name, value in effect.parameters.items()
        ]
        rows += [
            [escape(effect.id), escape(each.expression), *html.with_error(each.known)] for each in effect.determined
        ]
    return pieces.table(
        ("of", "parameter", "value", "90 % interval", "unit"),
        rows,
        caption="Parameters (model.toml has them in SI units)",
    )
