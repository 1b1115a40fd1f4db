"""Limit curves and the scatter of friction, as tables and sentences."""

from __future__ import annotations

import math
from collections.abc import Sequence

from station.friction.limit_curve.curve import Estimate, LimitCurveFit, Score
from station.friction.limit_curve.multiplier import PARAMETERS
from station.friction.report_table import ReportTable, chance, number, p_is
from station.friction.results import PairResult

_KINDS = {"isotropic": "circle", "ellipse": "ellipse", "one_way": "one-way", "general": "general"}
_FRAMES = {"object": "the object", "plate": "the plate", "both": "object and plate"}
_ONE_WAY = "one-way curves"
"""The curves of which the test against a circle is: they have whatever shape is common."""
_DEGREES = 180 / math.pi
_LEVEL = 0.05


def curve_tables(results: Sequence[PairResult]) -> tuple[ReportTable, ...]:
    """Returns the tables of all pairs that have a limit curve."""
    fits = [(result.pair.name, result.limit_curve) for result in results if result.limit_curve is not None]
    return (_curves_table(fits), _kinds_table(fits), _scatter_table(fits)) if fits else ()


def _curves_table(fits: Sequence[tuple[str, LimitCurveFit]]) -> ReportTable:
    rows: list[tuple[str, ...]] = []
    for name, fit in fits:
        for suffix, frame in (("", fit.frame), ("_plate", "plate"))[: 1 + (fit.frame == "both")]:
            where = "" if fit.kind == "isotropic" else f", {'object' if frame == 'both' else frame}"
            rows.append((f"{name}{where}", _KINDS[fit.kind], *_curve_row(fit, suffix)))
    return ReportTable(
        title="Limit curves (90 % intervals)",
        columns=(
            "pair, frame",
            "curve",
            "n",
            "censored",
            "µ mean",
            "µ1",
            "µ2",
            "axis °",
            "one-way",
            "at °",
            "scatter µ",
        ),
        rows=tuple(rows),
        note=(
            "The curves are fitted by maximum likelihood to onset and slide together, and censored samples count, "
            "too. µ mean is the geometric mean over all directions in the middle of the session; µ1 is along the axis "
            "and µ2 across it, both of the nearest ellipse. One-way is the ratio of friction forwards over backwards, "
            "which is highest towards the angle beside it. Scatter is that of ln µ from run to run, of Student's t its "
            "scale."
        ),
    )


def _curve_row(fit: LimitCurveFit, suffix: str) -> tuple[str, ...]:
    found = fit.estimates
    return (
        str(fit.slides + fit.bracketed),
        str(fit.censored),
        _interval(found.get("level"), ".3f"),
        *(_interval(found.get(name + suffix), ".3f") for name in ("mu_1", "mu_2")),
        _interval(found.get("axis_rad" + suffix), ".0f", scale=_DEGREES),
        _interval(found.get("one_way" + suffix), ".3f"),
        _interval(found.get("one_way_rad" + suffix), ".0f", scale=_DEGREES),
        _interval(found.get("scatter"), ".1f", scale=100.0, unit=" %"),
    )


def _interval(estimate: Estimate | None, form: str, *, scale: float = 1.0, unit: str = "") -> str:
    if estimate is None:
        return "–"
    value, low, high = (number(each * scale, form) for each in (estimate.value, estimate.low, estimate.high))
    return f"{value} ({low} to {high}){unit}"


def _kinds_table(fits: Sequence[tuple[str, LimitCurveFit]]) -> ReportTable:
    rows: list[tuple[str, ...]] = []
    for name, fit in fits:
        least = min(score.bic for score in fit.scores)
        rows += [_kind_row(name, fit, score, least) for score in sorted(fit.scores, key=lambda score: score.bic)]
    return ReportTable(
        title="Kinds of limit curve",
        columns=("pair, curve", "shape parameters", "ln likelihood", "Δ BIC", "tested against", "p"),
        rows=tuple(rows),
        note="The curve of the least BIC is taken. Each p is of a likelihood-ratio test: of a curve against the "
        "largest one that it contains, and of the circle against one-way curves.",
    )


def _kind_row(name: str, fit: LimitCurveFit, score: Score, least: float) -> tuple[str, ...]:
    where = "" if score.kind == "isotropic" else f" ({score.frame})"
    against, p = (_ONE_WAY, fit.p_isotropic) if score.kind == "isotropic" else (_read(score.against), score.p_value)
    return (
        f"{name}, {_KINDS[score.kind]}{where}",
        str(score.shape_parameters),
        f"{score.log_likelihood:.1f}",
        f"{score.bic - least:.1f}",
        "–" if math.isnan(p) else against,
        chance(p),
    )


def _read(against: str) -> str:
    return against.replace("isotropic", "circle").replace("one_way", "one-way")


def _scatter_table(fits: Sequence[tuple[str, LimitCurveFit]]) -> ReportTable:
    rows: list[tuple[str, ...]] = []
    for name, fit in fits:
        multiplier, goodness = fit.multiplier, fit.goodness
        words = zip(PARAMETERS[multiplier.family], multiplier.parameters, strict=True)
        rivals = sorted(goodness.aic.items(), key=lambda item: item[1])[1:]
        rows.append(
            (
                name,
                multiplier.family.replace("_", "-"),
                ", ".join(f"{word} {value:.3g}" for word, value in words),
                f"{goodness.statistic:.2f}",
                chance(goodness.p_value),
                ", ".join(f"{family.replace('_', '-')} {value:+.1f}" for family, value in rivals),
            )
        )
    return ReportTable(
        title="Scatter of friction from run to run: what the curve is multiplied by",
        columns=("pair", "family", "parameters", "A²", "p", "Δ AIC of the others"),
        rows=tuple(rows),
        note="A² is Anderson and Darling's statistic, and p is by parametric bootstrap: a small one speaks against the "
        "family.",
    )


def curve_sentences(result: PairResult) -> tuple[str, ...]:
    """Tells the limit curve in sentences, or why there is none."""
    fit = result.limit_curve
    if fit is None:
        return (result.no_limit_curve,) if result.no_limit_curve else ()
    return (_shape_sentence(fit), _scatter_sentence(fit), *(f"Limit curve: {remark}." for remark in fit.remarks))


def _shape_sentence(fit: LimitCurveFit) -> str:
    found = fit.estimates
    tested = "nothing to test" if math.isnan(fit.p_isotropic) else _against_a_circle(fit)
    if fit.kind == "isotropic":
        words = f"a circle of µ = {_interval(found['level'], '.3f')}"
    else:
        kind = {"ellipse": "an ellipse", "one_way": "a one-way curve", "general": "a general curve"}[fit.kind]
        words = (
            f"{kind} fixed to {_FRAMES[fit.frame]}, µ1 = {_interval(found['mu_1'], '.3f')} along "
            f"{_interval(found['axis_rad'], '.0f', scale=_DEGREES)}° and µ2 = {_interval(found['mu_2'], '.3f')} across"
        )
        if "one_way" in found:
            at = _interval(found["one_way_rad"], ".0f", scale=_DEGREES)
            words += f", {_interval(found['one_way'], '.3f')} times higher towards {at}° than back"
    return f"Limit curve: {words}; {tested} (90 % intervals)."


def _against_a_circle(fit: LimitCurveFit) -> str:
    """Says what the test against a circle came to, and where test and choice differ, that they do."""
    p = p_is(fit.p_isotropic)
    if fit.kind != "isotropic":
        return f"{p} against a circle"
    if fit.p_isotropic >= _LEVEL:
        return f"consistent with a circle ({p} against {_ONE_WAY})"
    return f"a test speaks for {_ONE_WAY} ({p}), but not by enough for the parameters that they take (BIC)"


def _scatter_sentence(fit: LimitCurveFit) -> str:
    scatter, family = _interval(fit.estimates["scatter"], ".1f", scale=100), fit.multiplier.family.replace("_", "-")
    fits = "is not contradicted" if fit.goodness.p_value >= _LEVEL else "does not fit well"
    return (
        f"From run to run the curve is multiplied by a {family} number, scatter {scatter} %; this family {fits} "
        f"(Anderson-Darling {p_is(fit.goodness.p_value)})."
    )
