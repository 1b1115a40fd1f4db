"""The answer in words says no more than is so, and no number that is none."""

from __future__ import annotations

import io
import math
import re
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from rich.console import Console

from station.diagnosis.diagnose import examined
from station.diagnosis.observations.channel import Channel
from station.diagnosis.report.html import with_error
from station.diagnosis.report.page import html_page
from station.diagnosis.report.sentences import next_lines, own_level, sentence
from station.diagnosis.report.summary import summary
from station.diagnosis.result import Combination, Diagnosis, EffectFound, NextExperiment, Value
from station.diagnosis.search.locate import summary_of
from station.diagnosis.search.places import Place
from station.physics.catalogue import catalogue
from station.physics.contact import Array
from station.physics.model import Model
from tests.unit.diagnosis.tables import grained, samples


def told(found: Diagnosis) -> str:
    text = io.StringIO()
    Console(file=text, width=200).print(summary(found))
    return text.getvalue()


def test_a_number_that_is_none_is_a_dash() -> None:
    none = Value(value=math.nan, sd=math.nan, unit="m")
    assert str(none) == "–"
    assert with_error(none) == ("–", "–", "mm")


def test_a_recording_that_tells_nothing_prints_no_nan() -> None:
    found = examined(samples(runs=12), catalogue())
    assert not re.search(r"\bnan\b", html_page(found.diagnosis, found.pictures) + told(found.diagnosis))


def test_what_was_not_tested_has_no_p() -> None:
    few = examined(samples(runs=5), catalogue()).diagnosis
    assert few.verdict == "untestable"
    assert "global p" not in told(few)
    assert re.search(r", mu_s = 0\.\d+ ± 0\.\d+, global p", told(grained().diagnosis).replace("\n", " "))


def test_of_a_number_at_its_bound_only_that_is_said() -> None:
    answer = grained().diagnosis
    inside, held = (Value(value=0.5, sd=0.1, unit="1", at_bound=at_bound) for at_bound in (False, True))
    effect = replace(answer.effects[0], parameters={"size": inside, "shape": held}, determined=())
    assert "size = 0.50 ± 0.10; shape is at its bound" in told(replace(answer, effects=(effect,)))


def test_the_plain_model_explains_nothing_that_is_beyond_chance() -> None:
    plain = replace(grained().diagnosis, effects=(), located=(), verdict="not supported")
    assert "explains" not in sentence(replace(plain, global_p=1e-6))
    assert "explains" in sentence(replace(plain, global_p=0.5))


def test_what_predicts_worse_than_a_guess_explains_nothing() -> None:
    plain = replace(grained().diagnosis, effects=(), located=(), verdict="not supported", global_p=0.5)
    missing = replace(plain.fit, before=replace(plain.fit.before, onset_median_deg=65.0))
    said = sentence(replace(plain, fit=missing))
    assert "explains nothing here: it misses unseen onsets by 65.0°" in said
    assert "unit of the angles" in said


def test_a_number_of_which_only_a_combination_is_known_is_not_said_to_be_at_its_bound() -> None:
    slope = Combination(expression="change of friction per e-fold of speed", value=0.0224, sd=0.0006, unit="1")
    law = EffectFound(
        id="rate_strengthening", title="friction by speed", class_ids=("rate_strengthening",), probability=1.0,
        verdict="supported", parameters={"per_e_fold": Value(value=0.2, sd=0.1, unit="1", at_bound=True)},
        determined=(slope,),
    )  # fmt: skip
    said = told(replace(grained().diagnosis, effects=(law,)))
    assert "0.02240 ± 0.00060; per_e_fold alone is not determined" in said
    assert "bound" not in said


def test_a_simulation_that_leaves_nothing_out_may_differ_all_the_same() -> None:
    given = replace(grained().diagnosis, effects=(), located=(), verdict="not supported", given=True)
    assert sentence(replace(given, global_p=0.5)) == "Nothing is left out of the simulation."
    assert "no name explains all that differs" in sentence(replace(given, global_p=1e-6))


def test_a_gain_beyond_the_expected_one_is_compared_and_never_called_a_share() -> None:
    found = grained()
    fit = replace(found.diagnosis.fit, gap_closed=1.51, gap_closed_se=0.28)
    lucky = replace(found.diagnosis, fit=fit)
    words = "1.51 ± 0.28 times the gain to expect if the model is right"
    for text in (told(lucky), html_page(lucky, found.pictures)):
        assert words in " ".join(text.split())
        assert not re.search(r"share of the gap|closes 1|could gain", text)
    nothing = replace(lucky, fit=replace(fit, gap_closed=math.nan, gap_closed_se=math.nan))
    assert "the gain to expect" not in told(nothing) + html_page(nothing, found.pictures)


def test_other_says_on_what_it_depends_and_how_strongly() -> None:
    table = [
        replace(one, temperature_c=20.0 + 10.0 * math.sin(place / 7.0)) for place, one in enumerate(samples(runs=120))
    ]
    bent = [
        replace(
            one, onset_angle_rad=math.atan(math.tan(one.onset_angle_rad) * (1.3 if one.temperature_c > 22 else 1.0))
        )
        for one in table
    ]
    found = examined(bent, catalogue()).diagnosis
    (other,) = [one for one in found.effects if one.verdict != "not supported"]
    assert other.id == "other"
    said = re.search(r"friction changes by about (\d+) % with the temperature", other.title)
    assert said, other.title
    assert 20 < float(said[1]) < 40
    assert other.title in told(found)


@pytest.mark.parametrize(
    ("before", "words"),
    [
        ({"onsets": 60, "own_level": {}}, "each run at its own level of friction"),
        ({"onsets": 57, "own_level": {}}, "57 of 60 runs at their own level of friction"),
        ({"onsets": 0, "own_level": {}}, ""),
        ({"onsets": 60}, ""),
    ],
)
def test_a_level_of_its_own_has_a_run_whose_onset_tells_it(before: dict[str, object], words: str) -> None:
    assert own_level({"runs": 60, "before": before}) == words


@pytest.mark.parametrize(
    ("nested", "words"),
    [
        (True, "Names and numbers were found without the rows that are predicted."),
        (False, "Numbers were fitted without the rows that are predicted; the names were found with all rows"),
    ],
)
def test_what_is_held_out_is_said_as_it_was_done(nested: bool, words: str) -> None:
    found = grained()
    fit = replace(found.diagnosis.fit, nested=nested)
    assert words in html_page(replace(found.diagnosis, fit=fit), found.pictures)


def test_turning_is_told_in_degrees() -> None:
    def constant(_: object) -> Array:
        return np.full(30, 5.6)

    rows = SimpleNamespace(limit=np.zeros(30, dtype=np.bool_), sigma=np.ones(30))
    channel = SimpleNamespace(
        rows=rows, residual=constant, off=constant, shares_friction=False, phase="slide",
        title="the block's turning", unit="rad/s²",
    )  # fmt: skip
    place = Place(cast(Channel, channel), "all", np.ones((30, 1)), (0,))
    said = summary_of(Model(mu_s=0.4), place)
    assert said == "slide: the block's turning is off by 320 °/s² throughout"


def test_the_next_step_ends_with_a_full_stop() -> None:
    found = grained().diagnosis
    bare = NextExperiment(separates=(), plan="", runs=0, why="the same loads in random order")
    for plan in (found.next_experiment, bare, None):
        assert re.search(r"[^.]\.$", next_lines(replace(found, next_experiment=plan))[0])


def test_the_next_step_of_a_simulated_session_is_simulated() -> None:
    found = grained().diagnosis
    plan = NextExperiment(separates=(), plan="samples = 40\n", runs=40, why="more runs")
    for lockstep, run in ((False, "station run --plan next.toml"), (True, "station run --lockstep --plan next.toml")):
        lines = next_lines(replace(found, next_experiment=replace(plan, lockstep=lockstep)))
        assert lines[1].endswith(f"; {run}")
