import math
from typing import Any

import numpy as np
import pytest

from tests.proof.gates import Gate, calibration, calibration_error, gates
from tests.proof.scoring import Scored
from tests.unit.proof.made_up import claim, concealed, place, said, scored, truth


def gate(cases: list[Scored], key: str) -> Gate:
    return {one.key: one for one in gates(cases)}[key]


def null(*claims: dict[str, Any], gain: float | None = None) -> Scored:
    refit = {} if gain is None else {"tool": {"gain": gain, "se": 0.01}}
    return scored(truth("null", answer="none"), said(*claims), **refit)


def single(*claims: dict[str, Any], strength: float = 4.0, **refit: object) -> Scored:
    return scored(truth("single", concealed("viscous", strength=strength)), said(*claims), **refit)


def test_false_alarms_count_every_claim_and_every_fault():
    quiet = [null() for _ in range(97)]
    assert gate([*quiet, null(claim("wear"))], "false_alarms").met is True
    loud = [*quiet, *[null(claim("wear"))] * 5, null(claim("other"))]
    assert gate(loud, "false_alarms").value == pytest.approx(6 / 103)
    assert gate(loud, "false_alarms").met is False
    broken = scored(truth("null", answer="none"), said())
    broken = Scored(truth=broken.truth, said=type(broken.said)(answer={}, wall_s=1.0, fault="ValueError"))
    assert gate([broken], "false_alarms").value == 1.0
    assert gate([broken], "faults").met is False


def test_a_loss_on_one_null_breaks_the_gate():
    assert gate([null(), null(gain=0.01)], "null_loss").met is True
    assert gate([null(), null(claim("wear"), gain=-0.01)], "null_loss").met is False


def test_paths_that_are_better_without_a_right_name_are_counted():
    def led(gain_mm: float) -> Scored:
        own = {"held_out": {"path_gain_mm": gain_mm, "path_gain_se_mm": 0.01}}
        fit: dict[str, Any] = {
            "fit": {when: {"path_rmse_mm": 1.0, "onset_rmse_deg": 1.0} for when in ("before", "after")}
        }
        return scored(truth("single", concealed("viscous")), said(claim("viscous") | own, **fit))

    assert gate([led(0.03), led(-0.01), led(-0.03)], "path_rises").value == pytest.approx(1 / 3)


def test_names_at_twice_the_limit_or_more():
    right, wrong = claim("viscous"), claim("kinetic_drop")
    cases = [single(right)] * 19 + [single(wrong)] + [single(wrong, strength=1.0)] * 5
    assert gate(cases, "first").value == 0.95
    assert gate(cases, "first").cases == 20
    assert gate(cases, "first").met is True
    assert gate([*cases, single()], "first").met is False
    assert gate([*cases, single()], "missed").value == pytest.approx(1 / 21)
    assert gate(cases, "sure_wrong").value == pytest.approx(1 / 20)


def test_a_truth_in_the_class_is_right_within_and_wrong_as_a_name():
    cases = [single(claim("kinetic_drop", near=("viscous",), verdict="indistinguishable"))]
    assert gate(cases, "first").value == 0.0
    assert gate(cases, "class").value == 1.0


def test_what_is_not_supported_is_not_claimed():
    assert gate([single(claim("viscous", verdict="not supported"))], "first").value == 0.0


def test_both_of_a_pair_must_be_names_of_their_own():
    pair = truth("pair", concealed("viscous"), concealed("wear"))
    assert gate([scored(pair, said(claim("viscous"), claim("wear")))], "both").value == 1.0
    assert gate([scored(pair, said(claim("viscous", near=("wear",))))], "both").value == 0.0
    assert gate([scored(pair, said(claim("viscous", near=("wear",))))], "both_class").value == 1.0


def test_the_gap_is_the_share_of_what_the_oracle_gains():
    oracle = {"gain": 0.5, "se": 0.05}
    cases = [single(claim("viscous"), oracle=oracle, tool={"gain": gain, "se": 0.1}) for gain in (0.3, 0.45, 0.5)]
    assert gate(cases, "gap").value == pytest.approx(0.9)
    assert gate([*cases, single(oracle=oracle)], "gap").value == pytest.approx(0.75)
    more = single(claim("viscous"), oracle=oracle, tool={"gain": 1.5, "se": 0.1})
    assert gate([more], "gap").value == 1.0
    nothing = single(claim("viscous"), oracle={"gain": 0.01, "se": 0.05}, tool={"gain": 0.0, "se": 0.1})
    assert gate([nothing], "gap").cases == 0


def test_confident_wrong_names_and_doubtful_ones():
    hidden = truth("absorbed", concealed("adhesion"), answer="untestable")
    sure, doubtful = claim("wear"), claim("wear", near=("run",), verdict="indistinguishable")
    assert gate([scored(hidden, said(sure))], "confident").value == 1.0
    assert gate([scored(hidden, said(doubtful))], "confident").value == 0.0
    assert gate([scored(hidden, said(claim("wear", probability=0.5)))], "confident").value == 0.0
    assert gate([scored(hidden, said())], "confident").met is True


def test_outside_the_catalogue():
    outside = truth("outside", concealed("slow_tide"), answer="other")
    good = scored(outside, said(claim("other"), located=(place("onset", "run"),)))
    bad = scored(outside, said(claim("wear"), located=(place("slide", "speed"),)))
    assert (gate([good], "outside").value, gate([good], "misnamed").value) == (1.0, 0.0)
    assert (gate([bad], "outside").value, gate([bad], "misnamed").value) == (0.0, 1.0)


def test_calibration_error_is_the_weighted_distance_from_the_diagonal():
    rows = np.array([(0.95, 1.0)] * 19 + [(0.95, 0.0)] + [(0.55, 1.0)] * 20)
    assert calibration_error(rows) == pytest.approx(0.5 * 0.45)
    honest = calibration([(0.95, True)] * 19 + [(0.95, False)])
    assert honest.value == pytest.approx(0.0)
    assert honest.met is True
    assert calibration([(0.95, True)] * 10 + [(0.95, False)] * 10).met is False


def test_time_is_scaled_to_two_hundred_runs():
    assert gate([single()], "seconds_200").value == pytest.approx(40.0)


def test_a_gate_without_cases_is_neither_met_nor_missed():
    empty = gates([])
    assert all(one.met is None for one in empty)
    assert all(math.isnan(one.value) for one in empty)


def test_an_interval_that_holds_the_gate_is_not_sure():
    few = gate([single(claim("viscous"))] * 5, "first")
    many = gate([single(claim("viscous"))] * 100, "first")
    assert (few.met, few.sure) == (True, False)
    assert (many.met, many.sure) == (True, True)


def test_every_null_counts_whichever_tier_it_is_of():
    quiet = scored(truth("twin_null", answer="none"), said())
    loud = scored(truth("frames", answer="none"), said(claim("wear")))
    hidden = truth("frames", concealed("viscous", strength=math.nan))
    cases = [quiet, loud, scored(hidden, said(claim("viscous"))), scored(hidden, said())]
    assert (gate(cases, "false_alarms").value, gate(cases, "false_alarms").cases) == (0.5, 2)
    assert (gate(cases, "first").value, gate(cases, "first").cases) == (0.5, 2)


def test_nulls_whose_p_is_uniform_pass_and_those_whose_p_is_small_do_not():
    def with_p(values: np.ndarray) -> list[Scored]:
        return [scored(truth("null", answer="none"), said(global_p=float(p))) for p in values]

    even = gate(with_p(np.linspace(0.01, 0.99, 50)), "null_ks")
    assert (even.met, even.cases) == (True, 50)
    assert gate(with_p(np.full(50, 1e-6)), "null_ks").met is False


def test_a_name_that_the_key_allows_as_well_is_right():
    either = concealed("stribeck", also=("kinetic_drop",))
    assert gate([scored(truth("single", either), said(claim("kinetic_drop")))], "first").value == 1.0
    pair = truth("pair", either, concealed("kinetic_drop", also=("stribeck",)))
    assert gate([scored(pair, said(claim("kinetic_drop")))], "both").value == 0.0
    assert gate([scored(pair, said(claim("kinetic_drop"), claim("stribeck")))], "both").value == 1.0


def test_what_a_right_name_does_to_unseen_runs():
    def with_path(before: float, after: float) -> Scored:
        fit = {when: {"path_rmse_mm": mm} for when, mm in (("before", before), ("after", after))}
        return scored(truth("single", concealed("viscous")), said(claim("viscous"), fit=fit))

    cases = [with_path(1.0, 0.5), with_path(0.5, 1.0), single(claim("wear"))]
    assert (gate(cases, "path_falls").value, gate(cases, "path_falls").cases) == (0.5, 2)
