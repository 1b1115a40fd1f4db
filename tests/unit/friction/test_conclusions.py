"""Conclusions of samples that tell little or nothing, and of good ones, are said in words."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from shared.messages import CameraGeometry, Sample
from station.friction.conclusions import conclusions
from station.friction.limit_curve.curve import LimitCurve, Score
from station.friction.limit_curve.shape import Kind
from station.friction.pairs import Session, pairs_of
from station.friction.report_curves import curve_sentences, curve_tables
from station.friction.report_tables import tables
from station.friction.results import PairResult, analyse, with_limit_curves
from tests.unit.export.test_from_fit import fit
from tests.unit.friction.sessions import GEOMETRY, sample, session


def said(samples: Sequence[Sample], geometry: CameraGeometry | None = GEOMETRY) -> tuple[str, list[str]]:
    """All sentences about the only pair, and those that are findings."""
    results = analyse(pairs_of([Session(samples, geometry)]), rng=np.random.default_rng(1))
    assert len(results) == 1
    assert [len(table.rows[0]) for table in tables(results) if table.rows] == [
        len(table.columns) for table in tables(results) if table.rows
    ]
    notes = conclusions(results[0])
    return " ".join(note.text for note in notes), [note.text for note in notes if note.finding]


def good(count: int = 60, seed: int = 1) -> list[Sample]:
    return session(count, rng=np.random.default_rng(seed))


def test_good_samples_have_no_findings_and_their_numbers_are_those_of_the_samples():
    samples = good()
    text, findings = said(samples)
    assert findings == []
    angles = np.array([one.onset_angle_rad for one in samples])
    assert f"scatter {100.0 * angles.std(ddof=1) / angles.mean():.1f} %" in text
    mean, error = np.degrees([angles.mean(), angles.std(ddof=1) / math.sqrt(60)])
    assert f"{mean:.2f} ± {error:.2f}°" in text
    assert "No dependence on the sliding direction against the object" in text
    assert "and chance alone stays below" in text


def test_planted_anisotropy_is_said():
    samples = session(
        200, rng=np.random.default_rng(1), mu=lambda phi: 0.36 * math.exp(0.15 * math.cos(2 * phi)), aspect=0.7
    )
    text, findings = said(samples)
    assert findings == []
    assert "Friction depends on the sliding direction against the object, highest at" in text
    assert "chance alone" not in text.split("against the plate")[0]  # two tests must not contradict each other
    assert "square" not in text


@pytest.mark.parametrize(
    ("samples", "geometry", "expected"),
    [
        (good(), None, "There is no calibration"),
        (good(12), GEOMETRY, "Fewer than 25 samples are kept (12)"),
        (good(12), GEOMETRY, "Anisotropy cannot be tested with 12 samples"),
        (good(1), GEOMETRY, "Anisotropy cannot be tested with 1 sample;"),
        ([sample()], GEOMETRY, "One sample is kept"),
        (
            [one for one in session(160, rng=np.random.default_rng(1), turning=False) if one.direction == 2],
            GEOMETRY,
            "a single direction",
        ),
        (session(160, rng=np.random.default_rng(1), turning=False), GEOMETRY, "hardly turned"),
        (
            [sample(run=run, slide_m=0.001) for run in range(30)],
            GEOMETRY,
            "All 30 samples that slid were filtered, most by the dist",
        ),
        ([replace(one, censored=True) for one in good()], GEOMETRY, "All samples are censored"),
        ([Sample(run=run, onset_angle_rad=0.3 + 0.001 * run) for run in range(30)], GEOMETRY, "corners"),
        ([replace(one, object="") for one in good()], GEOMETRY, "do not name their object"),
        (
            [replace(one, block_mass_kg=0.008 if one.run % 2 else 0.016) for one in good()],
            GEOMETRY,
            "different masses (8 to 16 g)",
        ),
    ],
)
def test_each_lack_is_one_sentence(samples: list[Sample], geometry: CameraGeometry | None, expected: str):
    _, findings = said(samples, geometry)
    assert sum(expected in sentence for sentence in findings) == 1


def test_censored_runs_change_no_number_and_are_told():
    samples = good()
    text, _ = said(samples)
    with_stuck, _ = said([*samples, *(replace(sample(run=99 + i, angle_rad=0.9), censored=True) for i in range(20))])
    assert "20 of 80 samples (25.0 %) are censored" in with_stuck
    assert text.split("° (mean")[0] == with_stuck.split("° (mean")[0]


def test_onsets_of_the_threshold_rule_are_told():
    samples = good()
    samples[3] = replace(samples[3], flags=("onset_unresolved",))
    assert "For 1 of the kept samples no onset could be fitted" in said(samples)[0]


def test_objects_and_plates_are_pairs_of_their_own_however_the_files_mix_them():
    mixed = [replace(one, object="nut" if one.run % 2 else "cube") for one in good()]
    more = [replace(one, object="nut", plate="steel") for one in good(30, seed=2)]
    pairs = pairs_of([Session(mixed, GEOMETRY, "a.mcap"), Session([*more, *mixed[:4]], None, "b.mcap")])
    assert [(pair.name, len(pair.samples)) for pair in pairs] == [
        ("cube on wood", 32),
        ("nut on steel", 30),
        ("nut on wood", 32),
    ]
    assert [pair.uncalibrated for pair in pairs] == [("b.mcap",)] * 3
    results = analyse(pairs, rng=np.random.default_rng(1))
    words = [next(note.text for note in conclusions(one) if "calibration" in note.text) for one in results]
    assert words[0].startswith("1 of 2 files has no calibration (b.mcap): without one, directions hold if")
    assert words[1].startswith("There is no calibration: without one, directions hold if")


def test_four_pairs_without_anisotropy_are_seldom_said_to_have_any():
    wrong = 0
    for seed in range(15):
        rng = np.random.default_rng(seed)
        names = [("steel", "steel"), ("steel", "wood"), ("wood", "steel"), ("wood", "wood")]
        samples = [replace(one, object=a, plate=b) for a, b in names for one in session(60, rng=rng)]
        results = analyse(pairs_of([Session(samples, GEOMETRY)]), rng=rng)
        wrong += any("Friction depends" in note.text for result in results for note in conclusions(result))
    assert wrong <= 4  # 0.75 of 15 studies are expected at the level of 5 %; five or more would come once in 1600 times


@pytest.mark.parametrize(
    ("kind", "p", "expected"),
    [
        ("isotropic", 0.4, "; consistent with a circle (p = 0.4 against one-way curves) ("),
        ("isotropic", 0.01, "a test speaks for one-way curves (p = 0.01), but not by enough for the parameters"),
        ("isotropic", math.nan, "nothing to test"),
        ("ellipse", 0.4, "p = 0.4 against a circle"),
    ],
)
def test_a_curve_that_is_a_circle_is_consistent_with_one(kind: Kind, p: float, expected: str) -> None:
    sizes = {"level": 0.4, "mu_1": 0.4, "mu_2": 0.4, "axis_rad": 0.0}
    fitted = replace(fit(LimitCurve(level=0.4, frame="plate"), kind, **sizes), p_isotropic=p)
    result = cast("PairResult", SimpleNamespace(limit_curve=fitted))
    assert expected in curve_sentences(result)[0]


def test_the_table_of_curves_has_the_p_of_the_sentence() -> None:
    """Two tests of nearly the same gave 0.91 in the sentence and 0.92 in the table, which did not have the first."""
    score = Score(
        kind="isotropic", frame="object", shape_parameters=0, log_likelihood=1.0, bic=2.0, against="", p_value=math.nan
    )  # fmt: skip
    fitted = replace(fit(LimitCurve(level=0.4), "isotropic", level=0.4), p_isotropic=0.9149, scores=(score,))
    result = cast("PairResult", SimpleNamespace(limit_curve=fitted, pair=SimpleNamespace(name="a on b")))
    (row,) = next(table for table in curve_tables([result]) if table.title == "Kinds of limit curve").rows
    assert row[-2:] == ("one-way curves", "0.91")
    assert "(p = 0.91 against one-way curves)" in curve_sentences(result)[0]


def test_the_notes_of_the_tables_are_sentences() -> None:
    rng = np.random.default_rng(1)
    results = analyse(pairs_of([Session(session(60, rng=rng), GEOMETRY)]), rng=rng)
    for table in tables(with_limit_curves(results, rng=rng)):
        assert not re.search(r"(^|[.;] )[^.;:]{1,20}: ", table.note), table.note
