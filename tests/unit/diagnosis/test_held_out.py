"""Unseen runs: who is left out, how far their simulated slides go astray, and what could be scored at most."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy import stats

from station.diagnosis import thresholds
from station.diagnosis.inference.ceiling import entropy, expected_log_run
from station.diagnosis.inference.fit import Fit, fit
from station.diagnosis.inference.level import levelled
from station.diagnosis.inference.noise_of import shaking_of
from station.diagnosis.likelihood.feedback import owed
from station.diagnosis.likelihood.slopes import decays, plain_decays
from station.diagnosis.likelihood.student import log_density
from station.diagnosis.likelihood.whitening import Whitening
from station.diagnosis.observations.build import evidence_of
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.setting import Setting
from station.diagnosis.predict.folds import FOLDS, assigned, refitted
from station.diagnosis.predict.held_out import predicted, with_paths
from station.diagnosis.predict.quality import quality, share_of_gap
from station.diagnosis.predict.resimulated import slide_errors
from station.physics.catalogue import catalogue
from station.physics.model import Model, Term
from station.simulators.simulator import simulator
from tests.unit.diagnosis.recorded import OPENING_RADIUS_M, golden, joined, session


@cache
def plain_fit() -> tuple[Evidence, Fit]:
    evidence = evidence_of(session(), Setting(opening_radius_m=OPENING_RADIUS_M))
    return evidence, fit(evidence, levelled(evidence, Model(mu_s=0.4)), ())


def test_a_right_model_leads_blocks_where_they_were_seen() -> None:
    evidence, plain = plain_fit()
    everyone = np.ones(evidence.runs, dtype=np.bool_)
    own = np.nan_to_num(evidence.channels[0].residual(plain.model))
    right = slide_errors(evidence, plain.model, everyone, run_effects=own).path_m
    lower = replace(plain.model, mu_s=0.95 * plain.model.mu_s)
    slippery = slide_errors(evidence, lower, everyone, run_effects=own).path_m
    assert np.isfinite(right).sum() > 0.8 * evidence.runs
    assert np.nanmedian(right) < 0.2e-3
    assert np.nanmedian(slippery) > 3.0 * np.nanmedian(right)


def test_a_plate_with_play_leads_blocks_where_they_were_seen() -> None:
    """A slide begins as the tilt waits, or has just turned: the play that is left then is not known from the slide."""
    recorded, rig = golden()
    rig = replace(rig, plate=replace(rig.plate, opening_m=2 * OPENING_RADIUS_M))
    play = Model(mu_s=0.35, terms=(Term(catalogue()["backlash"], {"half_width_rad": 0.01}),))
    session = joined([simulator("planar").repeat(recorded, play, rig=rig) for _ in range(4)])
    evidence = evidence_of(session, Setting(opening_radius_m=OPENING_RADIUS_M))
    everyone = np.ones(evidence.runs, dtype=np.bool_)
    own = np.nan_to_num(evidence.channels[0].residual(play))
    assert np.nanmedian(slide_errors(evidence, play, everyone, run_effects=own).path_m) < 0.2e-3  # it was 1.4 mm


def test_a_shaken_block_is_pushed_as_its_slide_began_and_not_again() -> None:
    """The simulation begins amid the slide: as if that began there, the path was 5 mm off."""
    recorded, rig = golden()
    rig = replace(rig, plate=replace(rig.plate, opening_m=2 * OPENING_RADIUS_M))
    values = {"sd_m_s2": 0.3, "cos1": 0.0, "sin1": 0.0, "tone_hz": 5.0}
    shaken = Model(mu_s=0.35, terms=(Term(catalogue()["arm_vibration"], values),))
    session = joined([simulator("planar").repeat(recorded, shaken, rig=rig) for _ in range(4)])
    evidence = evidence_of(session, Setting(opening_radius_m=OPENING_RADIUS_M))
    everyone, own = np.ones(evidence.runs, dtype=np.bool_), np.nan_to_num(evidence.channels[0].residual(shaken))
    assert np.nanmedian(slide_errors(evidence, shaken, everyone, run_effects=own).path_m) < 0.15e-3


def test_a_block_that_turns_is_led_by_what_turns_it() -> None:
    recorded, rig = golden()
    rig = replace(rig, plate=replace(rig.plate, opening_m=2 * OPENING_RADIUS_M))
    uneven = Model(mu_s=0.35, terms=(Term(catalogue()["uneven_contact"], {"x_m": 1e-3, "y_m": -5e-4, "lead": 0.0}),))
    session = joined([simulator("planar").repeat(recorded, uneven, rig=rig) for _ in range(4)])
    evidence = evidence_of(session, Setting(opening_radius_m=OPENING_RADIUS_M))
    everyone, own = np.ones(evidence.runs, dtype=np.bool_), np.nan_to_num(evidence.channels[0].residual(uneven))
    known, even = (slide_errors(evidence, one, everyone, run_effects=own) for one in (uneven, Model(mu_s=0.35)))
    assert np.nanmedian(known.turn_rad) < 0.1 * np.nanmedian(even.turn_rad)
    assert np.nanmedian(known.path_m) < np.nanmedian(even.path_m)


def test_every_run_is_predicted_by_a_fit_that_has_not_seen_it() -> None:
    evidence, plain = plain_fit()
    parts = refitted(evidence, plain, (), assigned(evidence, np.random.default_rng(1)))
    assert (np.sum([out for out, _ in parts], axis=0) == 1).all()
    assert all((part.counted == ~out).all() for out, part in parts)
    told = quality(with_paths(evidence, predicted(evidence, parts), parts))
    assert told.path_median_mm < 0.2
    assert 0.0 < told.se["path_median_mm"] < told.path_median_mm
    assert 0.0 < told.se["onset_rmse_deg"] < told.onset_rmse_deg


def test_runs_that_are_held_out_do_not_move_the_fit() -> None:
    """Their onsets are moved by a tenth: nothing that is fitted to the others changes."""
    evidence, plain = plain_fit()
    out = np.arange(evidence.runs) % FOLDS == 0
    part = fit(evidence.without(out), plain.model, (), noise=plain.noise)
    other = evidence.without(out)
    onset = other.channels[0]
    moved = np.where(out[onset.rows.run], onset.residual(plain.model) + 0.1, onset.residual(plain.model))
    shift = moved - onset.residual(plain.model)

    def moved_residual(self: Any, model: Model) -> Any:
        return type(onset).residual(self, model) + shift

    kind = type("Moved", (type(onset),), {"residual": moved_residual})
    changed = object.__new__(kind)
    changed.__dict__.update(onset.__dict__)
    again = fit(replace(other, channels=(changed, *other.channels[1:])), plain.model, (), noise=plain.noise)
    assert again.model.mu_s == pytest.approx(part.model.mu_s, rel=1e-9)
    assert again.log_likelihood == pytest.approx(part.log_likelihood, rel=1e-9)


def test_specimens_stay_together_where_there_are_enough_of_them() -> None:
    evidence, _ = plain_fit()
    specimen = np.arange(evidence.runs) % (2 * FOLDS)
    several = replace(evidence, facts=replace(evidence.facts, mass_kg=0.01 + 0.001 * specimen))
    fold = assigned(several, np.random.default_rng(1))
    assert len(np.unique(fold)) == FOLDS
    assert all(len(np.unique(fold[specimen == one])) == 1 for one in np.unique(specimen))


def test_the_ceiling_is_near_what_a_right_model_scores() -> None:
    evidence, plain = plain_fit()
    apart = plain.log_run - expected_log_run(evidence, plain)
    assert abs(apart.mean()) < 3.0 * apart.std() / np.sqrt(len(apart))


def scattered(evidence: Evidence, plain: Fit, by: float) -> Fit:
    """The fit of a recording whose rows scatter `by` times as much, scored with the same noise."""
    whitening = Whitening(evidence, plain.noise, shaking=shaking_of(evidence, plain.model))
    white = by * plain.white
    each = log_density(white, whitening.tail, whitening.limit)
    each += owed(whitening, decays(evidence, plain.model), plain_decays(evidence))
    log_run = np.bincount(whitening.run, each, evidence.runs) - whitening.log_scale + plain.log_prior / evidence.runs
    return replace(plain, white=white, log_run=log_run)


def test_no_recording_scores_above_its_ceiling_because_it_is_calm() -> None:
    """A recording with half its noise has a ceiling of its own; what rows with twice their noise lack, they lack."""
    evidence, plain = plain_fit()
    calm, wild = (scattered(evidence, plain, by) for by in (0.5, 2.0))
    assert (calm.log_run - expected_log_run(evidence, calm)).mean() == pytest.approx(0.0, abs=0.5)
    assert (calm.log_run - plain.log_run).mean() > 5.0
    assert (wild.log_run - expected_log_run(evidence, wild)).mean() < -20.0


def test_the_share_of_the_gap_has_the_error_of_a_ratio() -> None:
    """The error is compared with the scatter of 400 sessions of 60 runs whose gaps differ as much as they are."""
    rng = np.random.default_rng(4)
    found = [share_of_gap(0.8 * gap + rng.normal(0.0, 1.0, 60), gap) for gap in rng.gamma(1.0, 10.0, (400, 60))]
    values, errors = (np.array([getattr(one, name) for one in found]) for name in ("value", "sd"))
    assert values.mean() == pytest.approx(0.8, abs=3.0 * values.std() / 20.0)
    assert np.median(errors) == pytest.approx(values.std(), rel=0.15)
    assert np.isnan(share_of_gap(np.ones(60), rng.normal(0.0, 1.0, 60) - 0.1).value)


@pytest.mark.parametrize("tail", [3.0, 6.0, thresholds.GAUSSIAN])
def test_the_entropy_is_that_of_the_distribution(tail: float) -> None:
    wanted = stats.norm.entropy() if tail == thresholds.GAUSSIAN else stats.t(tail).entropy()
    assert entropy(np.array([tail]))[0] == pytest.approx(float(wanted), rel=1e-9)


def test_a_simulation_without_noise_can_be_fitted() -> None:
    recorded, rig = golden()
    rig = replace(rig, plate=replace(rig.plate, opening_m=2 * OPENING_RADIUS_M))
    exact = joined([simulator("planar").repeat(recorded, Model(mu_s=0.35), rig=rig) for _ in range(4)])
    evidence = evidence_of(exact, Setting(opening_radius_m=OPENING_RADIUS_M))
    found = fit(evidence, levelled(evidence, Model(mu_s=0.4)), ())
    assert np.isfinite(found.log_likelihood)
    assert found.model.mu_s == pytest.approx(0.35, rel=5e-3)
