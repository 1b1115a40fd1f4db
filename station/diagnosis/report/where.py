"""The section on where recording and simulation differ."""

from __future__ import annotations

from html import escape

from station.diagnosis import thresholds
from station.diagnosis.report import html
from station.diagnosis.report.curves import curves, drawable
from station.diagnosis.report.heat_map import heat_map
from station.diagnosis.report.picture_data import PictureData
from station.diagnosis.report.plate_map import channels_on_plate, plate_map
from station.diagnosis.report.sentences import claimed_effects, phases_of, singular, used, who_acts
from station.diagnosis.result import Acting, Diagnosis, Located, Tested, rounded
from station.pages import pieces
from station.pages.caption import Caption
from station.pages.figure import drawn

_MOST_RUNS, _MOST_STRETCHES = 15, 3
_MOMENT_NS = 5_000_000


def where(diagnosis: Diagnosis, pictures: PictureData) -> str:
    """Returns the section with residual maps over phase and covariate, the located curves, plate map, and places."""
    parts = [*_maps(diagnosis, pictures), *_curves(diagnosis, pictures), *_plate(diagnosis, pictures)]
    parts += [_places(diagnosis), _acting(diagnosis)]
    return pieces.section("Where they differ", *parts, name="where")


def _maps(diagnosis: Diagnosis, pictures: PictureData) -> list[str]:
    if not pictures.spots_before:
        return []
    first = heat_map(pictures.spots_before, title="Plain model: recorded − simulated")
    caption = Caption(
        shows="Every kind of evidence (rows, in the order of a run) against everything that could explain it "
        "(columns). The effect size is the share of the residuals that a smooth curve over the covariate takes up; p "
        "is that of stage 1, corrected for the whole search, by the one of two tests that has the smaller p. Framed "
        f"and coloured by the effect size: beyond chance (p < {thresholds.LEVEL:g}); all other cells stay pale.",
        count=used(diagnosis),
    )
    parts = [drawn(first, caption, name="map1", alt="map of residuals before")]
    if diagnosis.names:
        second = heat_map(pictures.spots_after, title="With what was found")
        same = "The same map of what the last stage tested: what the model that was found explains is pale."
        caption = Caption(shows=same, count=used(diagnosis))
        parts.append(drawn(second, caption, name="map2", alt="map of residuals after"))
    return parts


def _curves(diagnosis: Diagnosis, pictures: PictureData) -> list[str]:
    places = drawable(diagnosis.located)
    if not places:
        return []
    caption = Caption(
        shows="The clearest residual structure: the mean residual in ten bins of what explains it; each p is that "
        "of the table below.",
        count=used(diagnosis),
        interval="bars: 90 % intervals",
    )
    return [drawn(curves(places, pictures), caption, name="curves", alt="residuals over what explains them")]


def _plate(diagnosis: Diagnosis, pictures: PictureData) -> list[str]:
    if not channels_on_plate(pictures):
        return []
    caption = Caption(
        shows="Residuals where the block was on the plate (each picture less its median), a dot for each onset or "
        "window of a slide. Dotted: the foam's opening.",
        count=used(diagnosis),
    )
    shown = plate_map(pictures, after=bool(diagnosis.names))
    return [drawn(shown, caption, name="plate", alt="residuals on the plate")]


def _places(diagnosis: Diagnosis) -> str:
    if not diagnosis.located:
        return pieces.paragraph("No residual structure stands out beyond chance.")
    head = ("phase", "structure", "effect size", "p", "stage", "tested", diagnosis.counted, "longest stretches")
    rows = [_row(diagnosis, place) for place in diagnosis.located]
    return pieces.table(head, rows, caption="Residual structure by rank", note=_note(diagnosis))


def _acting(diagnosis: Diagnosis) -> str:
    """Returns the table of the phases in which the claimed effects act; empty without any."""
    found = [(effect, one) for effect in claimed_effects(diagnosis) for one in phases_of(effect)]
    rows = [[escape(who_acts(diagnosis, effect)), *_acts(one)] for effect, one in found]
    head = ("effect", "phase", "median", "most", f"in {singular(diagnosis)}")
    note = f"By how far the model without the effect is off, in units of the spread between equal {diagnosis.counted}."
    return pieces.table(head, rows, caption="Where the effects act", note=note) if rows else ""


def _acts(one: Acting) -> list[str]:
    run, most = one.most
    return [html.whole(one.phase), rounded(one.median, 2), rounded(most, 2), f"{run}"]


def _note(diagnosis: Diagnosis) -> str:
    """Returns the sentences that tell of what stage and of what test each p is."""
    stages = (
        "Every p is of what simulation and findings leave (rest), which no map shows"
        if diagnosis.given
        else "Each p is the smallest of all stages: stage 1 tests the residuals of the plain model, each later one "
        "what the stages before leave"
    )
    return (
        f"{stages}. Of two tests the one with the smaller p counts, as in the maps: of the row alone, or of a smooth "
        "term of friction, which onset and slide share."
    )


_TESTED: dict[Tested, str] = {"channel": "the row alone", "friction": "friction", "toppling": "toppling"}


def _row(diagnosis: Diagnosis, place: Located) -> list[str]:
    one = singular(diagnosis)
    runs = ", ".join(str(run) for run in place.runs[:_MOST_RUNS]) + (" …" if len(place.runs) > _MOST_RUNS else "")
    spans = "; ".join(html.whole(f"{one} {_run_text(run, length_ns)}") for run, length_ns in _longest(place))
    size, p = html.number(place.effect_size), html.whole(html.p_value(place.p))
    summary = place.summary.removeprefix(f"{place.phase}: ")
    stage = "rest" if diagnosis.given else str(place.stage)
    return [html.whole(place.phase), escape(summary), size, p, stage, _TESTED[place.tested], runs, spans]


def _run_text(run: int, length_ns: int) -> str:
    """Returns the run's number, and the stretch's length unless it is a moment, such as an onset."""
    return f"{run}, {1e-9 * length_ns:.2f} s" if length_ns > _MOMENT_NS else f"{run}"


def _longest(place: Located) -> list[tuple[int, int]]:
    """Returns the runs with the longest stretches, and these stretches' lengths (ns)."""
    lengths = dict[int, int]()
    for one in place.windows:
        lengths[one.run] = max(lengths.get(one.run, 0), one.to_ns - one.from_ns)
    return sorted(lengths.items(), key=lambda item: (-item[1], item[0]))[:_MOST_STRETCHES]
