"""The HTML report: self-contained, sound, and saying what was found."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from html import unescape
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binomtest

from station.__main__ import main
from station.app.front.text import as_text
from station.diagnosis import thresholds
from station.diagnosis.diagnose import Examined, examined
from station.diagnosis.observations.covariates import TITLES
from station.diagnosis.report import html, scales, scores
from station.diagnosis.report.curves import curves
from station.diagnosis.report.headline import headline
from station.diagnosis.report.heat_map import heat_map
from station.diagnosis.report.page import html_page
from station.diagnosis.report.picture_data import ChannelPicture, PictureData, Spot
from station.diagnosis.report.plate_map import plate_map
from station.diagnosis.report.sentences import next_lines, sentence
from station.diagnosis.report.summary import summary
from station.diagnosis.report.what import what
from station.diagnosis.result import Acting, Diagnosis, Located, Stretch, Value, rounded
from station.pages.drawing import style
from station.pages.figure import kept_in
from station.physics.catalogue import catalogue
from station.simulators import artefacts
from tests.legible import illegible
from tests.unit.diagnosis.page import Page
from tests.unit.diagnosis.tables import grained, samples


def page_of(found: Examined) -> Page:
    return Page(html_page(found.diagnosis, found.pictures, seed=7))


def with_slides() -> PictureData:
    """The table's pictures, and slides as a recording has them."""
    rng = np.random.default_rng(2)
    rows = 3000
    slide = ChannelPicture(
        name="along",
        unit="relative friction",
        x_m=rng.uniform(-0.04, 0.04, rows),
        y_m=rng.uniform(-0.04, 0.04, rows),
        before=rng.normal(0.0, 0.1, rows),
        after=rng.normal(0.0, 0.05, rows),
        limit=np.zeros(rows, dtype=np.bool_),
    )
    known = grained().pictures
    return replace(known, channels=(*known.channels, slide), opening_radius_m=0.045)


def test_the_page_is_one_sound_file_that_fetches_nothing() -> None:
    page = page_of(grained())
    assert [place for place in page.fetched if not place.startswith("data:")] == []
    assert len(page.ids) == len(set(page.ids))
    assert {place[1:] for place in page.references} <= set(page.ids)
    assert {"where", "what", "fit", "next", "provenance"} <= set(page.ids)
    assert page.figures == 6  # two maps, curves, plate, scores, onsets


def test_it_says_what_was_found_what_is_doubtful_and_what_to_do() -> None:
    found = grained()
    page = page_of(found)
    assert "either object_anisotropy, plate_anisotropy or a change with the" in page.text
    assert "indistinguishable from the best" in page.text
    assert found.diagnosis.located[0].summary in page.text
    for name, why in found.diagnosis.untestable.items():
        assert name in page.text
        assert " ".join(why.split()) in page.text
    assert found.diagnosis.next_experiment is not None
    assert " ".join(found.diagnosis.next_experiment.plan.split()) in page.text
    assert "seed 7" in page.text
    assert "recorded − predicted (°)" in page.text  # figures keep their words


def test_the_command_of_the_next_experiment_is_set_as_one() -> None:
    html_text = unescape(html_page(grained().diagnosis, grained().pictures))
    command = next_lines(grained().diagnosis)[1].strip()
    assert command.startswith("station diagnose ")
    assert f"<code>{command}</code>" in html_text


def test_what_has_no_name_is_told_by_what_it_goes_with() -> None:
    """A row of the comparison that says only `other` would leave the reader with nothing to look at."""
    found = grained()
    unnamed = [row.label for row in found.diagnosis.candidates if row.ids == ("other",)]
    assert unnamed
    assert all(told.startswith("other:") for told in unnamed)
    assert unnamed[0] in html_page(found.diagnosis, found.pictures)


def test_what_comes_from_outside_is_escaped() -> None:
    found = grained()
    nasty = '<script>alert("x")</script>&.mcap'
    text = html_page(replace(found.diagnosis, recording=nasty, notes=(nasty,)), found.pictures)
    assert "<script" not in text
    assert nasty in Page(text).text


def test_slides_are_drawn_on_the_plate_and_many_of_them_stay_small() -> None:
    text = html_page(grained().diagnosis, with_slides())
    assert "friction along the slide, before" in Page(text).text
    assert len(text) < 2_000_000


def test_the_same_diagnosis_gives_the_same_page() -> None:
    found = grained()
    assert html_page(found.diagnosis, found.pictures) == html_page(found.diagnosis, found.pictures)


def test_a_recording_that_the_plain_model_explains_gets_a_page_without_an_after() -> None:
    found = examined(samples(seed=5), catalogue(), name="plain.csv")
    page = page_of(found)
    assert "No missing effect is supported" in page.text
    assert page.figures >= 3
    assert "With what was found" not in page.text


def test_an_untestable_recording_gets_a_page_that_says_why() -> None:
    page = page_of(examined(samples(runs=3), catalogue(), name="short.csv"))
    assert "Nothing can be tested with this recording: expected at least 20 runs" in page.text
    assert page.figures == 0
    assert "wear" in page.text


def test_places_without_a_curve_are_listed_all_the_same() -> None:
    found = grained()
    place = Located(
        phase="slide", covariate="position", channel="along", effect_size=0.4, p=0.001, runs=tuple(range(40)),
        windows=(), summary="slide: more friction near the border",
    )  # fmt: skip
    page = Page(html_page(replace(found.diagnosis, located=(place,)), found.pictures))
    assert "slide: more friction near the border" in page.text


@pytest.mark.parametrize("verdict", ["supported", "not supported", "indistinguishable", "untestable"])
def test_every_verdict_has_its_sentence(verdict: str) -> None:
    found = replace(grained().diagnosis, verdict=verdict)  # pyright: ignore[reportArgumentType]: four words
    assert sentence(found).endswith(".")


# --- how things are said ----------------------------------------------------------------------------------------------


def test_what_the_simulators_settings_do_stands_first() -> None:
    found = grained()
    check = artefacts.said("solver_creep", 8.0615, "deg", cured_by="<cone>", before=12.147, after=None)
    text = html_page(replace(found.diagnosis, numerics=(check,)), found.pictures)
    assert "solver_creep blocks start earlier 8.06 deg 12.15 – <cone>" in Page(text).text
    assert text.index("Numerics first") < text.index("Where they differ")
    assert "Numerics first" not in html_page(found.diagnosis, found.pictures)


def test_a_recording_without_onsets_is_told_by_its_paths() -> None:
    found = grained().diagnosis
    nothing = replace(found.fit.before, onset_median_deg=math.nan)
    before, after = replace(nothing, path_median_mm=1.14), replace(nothing, path_median_mm=1.03)
    said = headline(replace(found, fit=replace(found.fit, before=before, after=after)))
    error = "the median path error at each run's own level of friction"
    assert f"has not seen, {error} goes from 1.14 mm to 1.03 mm, the log score" in unescape(said)
    assert "–" not in said
    before, after = replace(before, onset_median_deg=3.441), replace(before, onset_median_deg=3.44)
    said = headline(replace(found, fit=replace(found.fit, before=before, after=after)))
    assert "the median onset error stays at 3.44° (root mean square between equal rows" in said


def test_of_each_run_the_longest_stretch_is_named_once() -> None:
    found = grained()
    windows = tuple(
        Stretch(run=run, from_ns=0, to_ns=int(1e9 * length)) for run, length in ((3, 2.0), (3, 2.5), (5, 1.0), (3, 2.4))
    )
    place = replace(found.diagnosis.located[0], windows=windows)
    page = Page(html_page(replace(found.diagnosis, located=(place,)), found.pictures))
    assert page.text.count("row 3,") == 1
    assert "row 3, 2.50 s ; row 5, 1.00 s" in page.text


@pytest.mark.parametrize(
    ("value", "told"),
    [
        (Value(value=-0.00193298, sd=6e-7, unit="m"), ("−1.93298", "−1.93397 … −1.93199", "mm")),
        (Value(value=0.01, sd=0.002, unit="rad"), ("0.57", "0.38 … 0.76", "°")),
        (Value(value=-0.4, sd=0.02, unit="1"), ("−0.400", "−0.433 … −0.367", "")),
        (Value(value=-0.4, sd=math.nan, unit="s"), ("−400", "–", "ms")),
    ],
)
def test_parameters_have_units_and_digits_that_people_read(value: Value, told: tuple[str, str, str]) -> None:
    middle, interval, unit = html.with_error(value)
    assert (middle, re.sub("<[^>]*>", "", interval), unit) == told


def test_no_text_of_the_plates_maps_is_cut_or_lies_over_another() -> None:
    """A panel of equal scales shrinks after its layout, and has other numbers beside it then."""
    with style():
        assert [illegible(plate_map(with_slides(), after=after)) for after in (False, True)] == [[], []]


@pytest.mark.parametrize("across", [1, 3])
def test_every_covariate_and_channel_has_room_beside_its_curve(across: int) -> None:
    place = Located(
        phase="slide", covariate="speed", channel="along", effect_size=0.5, p=0.01, runs=(1,), windows=(), summary="",
        curve=tuple((0.3 * x, 0.02 * x, 0.01) for x in range(-5, 6)),
    )  # fmt: skip
    names = zip(TITLES, cycle(scales.CHANNELS), strict=False)
    places = [replace(place, covariate=covariate, channel=channel) for covariate, channel in names]
    with style():
        for first in range(0, len(places), across):
            assert illegible(curves(places[first : first + across], with_slides())) == []


def test_the_plate_is_shown_as_far_as_blocks_came() -> None:
    known = with_slides()
    wide = replace(known, opening_radius_m=0.75)
    limits = [plate_map(one, after=False).axes[0].get_xlim()[1] for one in (known, wide)]
    assert limits[0] == pytest.approx(45.0)
    assert limits[1] < 70.0


@pytest.mark.parametrize(("p", "told"), [(0.0312, "p = 0.031"), (1e-9, "p ≤ 1e-6")])
def test_a_small_p_has_no_equals_sign(p: float, told: str) -> None:
    assert html.p_equals(p) == told


# --- numbers of the figures -------------------------------------------------------------------------------------------


def test_the_interval_of_a_root_mean_square_holds_it_nine_times_in_ten() -> None:
    rng = np.random.default_rng(1)
    held = 0
    for _ in range(400):
        _, low, high = scores.root_mean_square(rng.normal(0.0, 2.0, 80))
        held += low <= 2.0 <= high
    assert 0.85 < held / 400 < 0.95


def test_shares_keep_within_nought_and_one() -> None:
    for hits, count in ((0, 5), (5, 5), (3, 7), (9, 10)):
        share, low, high = scores.wilson(hits, count)
        assert 0.0 <= low <= share <= high <= 1.0
        wanted = binomtest(hits, count).proportion_ci(0.9, method="wilson")
        assert (low, high) == pytest.approx((wanted.low, wanted.high), abs=1e-3)
    assert math.isnan(scores.wilson(0, 0)[0])


def test_an_interval_holds_its_share_where_all_or_none_hit() -> None:
    """Its upper end was 1e-16 below 1, and a figure of an error below 0 ends in a traceback."""
    for count in range(1, 400):
        for hits in (0, count):
            share, low, high = scores.wilson(hits, count)
            assert low <= share <= high


def test_ranks_are_uniform_and_coverage_right_where_the_model_is() -> None:
    pictures = examined(samples(runs=300, seed=8), catalogue()).pictures
    held = pictures.held_before
    assert held is not None
    inside = np.mean(np.abs(held.rank - 0.5) <= 0.45)
    assert 0.84 < inside < 0.96
    assert abs(float(np.mean(held.rank)) - 0.5) < 0.06


def test_residuals_after_are_smaller_than_before_where_something_was_found() -> None:
    channel = grained().pictures.channel("onset")
    assert channel is not None
    assert np.std(channel.after) < 0.4 * np.std(channel.before)
    assert grained().pictures.spots_before[0].p < 0.01
    assert len(channel.before) == 60


def test_each_figure_of_the_page_is_kept_as_svg_and_pdf(tmp_path: Path) -> None:
    with kept_in(tmp_path / "figures"):
        page = html_page(grained().diagnosis, with_slides())
    kept = {file.name for file in (tmp_path / "figures").iterdir()}
    stems = {name.partition(".")[0] for name in kept}
    assert len(stems) == page.count('<svg role="img"') >= 3
    assert kept == {f"{stem}.{kind}" for stem in stems for kind in ("svg", "pdf")}
    assert all((tmp_path / "figures" / f"{stem}.pdf").read_bytes().startswith(b"%PDF") for stem in stems)
    html_page(grained().diagnosis, with_slides())
    assert len(list((tmp_path / "figures").iterdir())) == len(kept)


def test_figures_belong_to_a_report(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["diagnose", "none.csv", "--figures", str(tmp_path / "figures")]) == 2
    assert "--report PATH together with --figures" in capsys.readouterr().err


def test_a_promised_standard_error_is_told_in_the_unit_of_what_is_known() -> None:
    assert Value(value=1.847e-3, sd=4.3e-5, unit="m").sharper(2.1e-5) == "± 0.021 mm, now 1.847 ± 0.043 mm"


def test_a_candidate_of_a_better_rank_has_no_smaller_share() -> None:
    """Odds of 41 stood between two laws that the verdict could not tell apart: the verdict allows for misfit."""
    diagnosis = grained().diagnosis
    first, *_ = diagnosis.candidates
    best = replace(first, fitted=True, bic=60.0, twice_log_odds=60.0, share=0.7)
    pair = replace(best, label="a pair", bic=62.0, twice_log_odds=19.0, share=0.25)
    last = replace(best, ids=("wear",), label="a third", bic=10.0, twice_log_odds=10.0, share=0.05)
    promised = replace(first, label="a score", twice_log_odds=first.twice_log_odds + 50.0, fitted=False)
    text = what(replace(diagnosis, candidates=(last, pair, best, promised)))
    ranked, scored = text.split("Stage 1: compared with the plain model")[1].split("Stage 1: not fitted")
    rows = [row.split("</td><td>") for row in ranked.split("<tr><td>")[1:]]
    assert [float(row[6]) for row in rows] == [0.7, 0.25, 0.05]
    assert ["indistinguishable" in row[8] for row in rows] == [False, True, False]
    assert "a score" in scored
    assert "a score" not in ranked


def test_no_row_contradicts_the_headline() -> None:
    """A law of the headline's class that its stage told apart had no word, and others had none either."""
    diagnosis = grained().diagnosis
    best = replace(diagnosis.candidates[0], ids=("object_anisotropy",), fitted=True, bic=99.0, share=0.9)
    rows = [
        best,
        replace(best, ids=("wear",), share=0.06),
        replace(best, ids=("plate_anisotropy",), share=0.02),
        replace(best, ids=("viscous",), share=0.01),
        replace(best, ids=("lens_distortion",), share=0.005, bic=-2.0),
    ]
    first, second = (replace(diagnosis.effects[0], class_ids=ids) for ids in (best.ids, ("plate_anisotropy",)))
    both = replace(first, class_ids=("object_anisotropy", "plate_anisotropy"))
    assert assessed(replace(diagnosis, candidates=tuple(rows), effects=(both,))) == [
        "the likeliest",
        "indistinguishable from the best here; without wear in the end",
        "indistinguishable in the end",
        "less likely",
        "not worth its parameters",
    ]
    alone = assessed(replace(diagnosis, candidates=tuple(rows), effects=(second,)))
    assert alone[0] == "the likeliest here; without object_anisotropy in the end"
    assert alone[2] == "found in the end"
    assert "decided in the end" in what(diagnosis)


def assessed(diagnosis: Diagnosis) -> list[str]:
    """The assessments of a diagnosis's first stage, by rank."""
    rows = what(diagnosis).split("compared with the plain model")[1].split("</table>")[0].split("<tr>")[2:]
    return [unescape(re.sub("<[^>]*>", "", row.split("<td>")[-1])).strip() for row in rows]


def test_phases_without_the_effect_are_left_out() -> None:
    """A law of sliding was said to act at the onset, by 0, most in run 1."""
    found = grained()
    onset, slide = (Acting(phase=phase, runs=(1,), sizes=(size,)) for phase, size in (("onset", 0.0), ("slide", 8.2)))
    effects = tuple(replace(one, acting=(onset, slide)) for one in found.diagnosis.effects)
    text = html_page(replace(found.diagnosis, effects=effects), found.pictures)
    table = text.split("Where the effects act")[1].split("</table>")[0]
    assert "<td>8.2</td>" in table
    assert "onset" not in table


def test_the_shares_of_the_table_are_those_of_the_posterior() -> None:
    fitted = [row for row in grained().diagnosis.candidates if row.fitted and row.stage == 0]
    assert 0.5 < sum(row.share for row in fitted) <= 1.0
    assert all(row.share == 0.0 for row in grained().diagnosis.candidates if not row.fitted)


def test_only_what_is_beyond_chance_has_a_colour() -> None:
    """A smooth curve through few residuals takes up most of them, by chance."""
    clear = Spot(phase="onset", channel="onset", covariate="dwell", effect_size=0.5, p=0.001)
    by_chance = replace(clear, covariate="run", effect_size=0.93, p=1.0)
    axes = heat_map([clear, by_chance], title="a map").axes[0]
    assert axes.images[0].get_array().tolist() == [[0.5, 0.0]]
    assert [text.get_text() for text in axes.texts] == ["0.50\np 0.001", "0.93\np 1"]
    assert len(axes.patches) == 1


def test_a_p_says_of_what_test_it_is() -> None:
    found = grained()
    place = replace(found.diagnosis.located[0], p=0.00021, stage=2, tested="friction")
    page = Page(html_page(replace(found.diagnosis, located=(place,)), found.pictures))
    assert "effect size p stage tested rows longest stretches" in page.text
    assert " 0.00021 2 friction " in page.text


def worn() -> Examined:
    """Returns the diagnosis of a table in which friction grows from run to run: one number that a smooth term tests."""
    made = [replace(one, onset_angle_rad=one.onset_angle_rad * (1 + 0.0012 * one.run)) for one in samples()]
    return examined(made, catalogue(), name="worn.csv")


@pytest.mark.parametrize(("make", "test"), [(grained, "channel"), (worn, "friction")])
def test_the_map_has_the_p_by_which_the_table_ranks(make: Callable[[], Examined], test: str) -> None:
    found = make()
    shown = {(spot.channel, spot.covariate): spot.p for spot in found.pictures.spots_before}
    first = [one for one in found.diagnosis.located if one.stage == 1]
    assert test in {one.tested for one in first}
    assert [one.p for one in first] == [shown[one.channel, one.covariate] for one in first]


@pytest.mark.parametrize("make", [grained, worn])
def test_what_was_found_is_pale_in_the_second_map(make: Callable[[], Examined]) -> None:
    """The rows' own p and the smooth terms' are of the last stage, which tests what the model leaves."""
    found = make()
    assert found.diagnosis.names
    assert min(spot.p for spot in found.pictures.spots_after) > thresholds.LEVEL


def test_numbers_have_no_power_of_ten() -> None:
    found = grained()
    check = artefacts.said("solver_creep", 0.61, "mm", cured_by="cone", before=0.61, after=6.04e-14)
    text = Page(html_page(replace(found.diagnosis, numerics=(check,)), found.pictures)).text
    assert "solver_creep blocks creep before they slide 0.610 mm 0.610 0.000 cone" in text
    assert [rounded(value, 2) for value in (321.0, -0.00123, 0.17, 0.0)] == ["320", "-0.0012", "0.17", "0"]


def test_the_error_of_a_single_run_has_no_error_of_its_own() -> None:
    """A simulator of which one run slid ended the whole answer in a traceback."""
    found = grained()
    one = {"path_median_mm": 35.0, "path_rmse_mm": 35.0, "se": {"path_median_mm": None, "path_rmse_mm": None}}
    rerun = {"engine": "my.py", "runs": 1, "before": one}
    single = replace(found.diagnosis, fit=replace(found.diagnosis.fit, simulator_rerun=rerun))
    assert "path error, median and rms 35.00 mm, 35.00 mm" in " ".join(as_text([summary(single)]).split())
    assert "my.py" in Page(html_page(single, found.pictures)).text


def test_one_thing_has_one_name_on_the_terminal_and_in_the_report() -> None:
    """The error of a simulated slide's path had two, and what a plain simulation leaves out read as a telegram."""
    found = grained().diagnosis
    quality = replace(found.fit.before, path_median_mm=1.14, path_rmse_mm=2.0)
    found = replace(found, fit=replace(found.fit, before=quality, after=quality))
    printed = as_text([summary(found)])
    level = "median path error at each run's own level of friction"
    assert f"{level} 1.14" in " ".join(printed.split())
    assert f"the {level} stays at 1.14 mm" in unescape(headline(found))
    own = {"engine": "my.py", "runs": 3, "before": {"path_median_mm": 35.0, "path_rmse_mm": 36.0, "se": {}}}
    beside = replace(found, fit=replace(found.fit, simulator_rerun=own))
    said = " ".join(as_text([summary(beside)]).split())
    assert "median path error at each run's own level of friction 1.14" in said
    assert "path error, median and rms 35" in said
    wanted = "The recording shows either object_anisotropy, plate_anisotropy or a change with the"
    assert wanted in " ".join(printed.split())
    assert ", which a simulation with one constant friction leaves out." in sentence(found)
    given = replace(found, given=True)
    assert ", which the simulation leaves out" in sentence(given)
