"""`--json`: every key of the contract is there with the right type, whatever the verdict."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import pytest

from station.diagnosis.diagnose import examined
from station.diagnosis.next_experiment.recommended import recommended
from station.diagnosis.result import Diagnosis, Located, Stretch
from station.diagnosis.result_json import as_json
from station.physics.catalogue import catalogue
from tests.unit.diagnosis.tables import grained, samples

NUMBER = (int, float, type(None))
QUALITY = {"log_score": NUMBER, "onset_rmse_deg": NUMBER, "path_rmse_mm": NUMBER, "coverage90": NUMBER}
ACTING = [{"phase": str, "runs": [int], "sizes": [NUMBER]}]
CONTRACT: dict[str, Any] = {
    "recording": str,
    "runs": {
        "total": int,
        "used": int,
        "held_out": int,
        "left_out": [{"reason": str, "count": int}],
        "without_onset": [{"reason": str, "count": int}],
    },
    "baseline": {"simulator": str, "parameters": {"mu_s": {"value": NUMBER, "sd": NUMBER}}},
    "global_p": NUMBER,
    "located": [
        {
            "phase": str,
            "covariate": str,
            "effect_size": NUMBER,
            "stage": int,
            "tested": str,
            "p": NUMBER,
            "runs": [int],
            "windows": [{"run": int, "from_ns": int, "to_ns": int}],
            "summary": str,
        }
    ],
    "verdict": str,
    "effects": [
        {"id": str, "class": [str], "probability": NUMBER, "verdict": str, "parameters": dict, "acting": ACTING}
    ],
    "other_probability": NUMBER,
    "none_probability": NUMBER,
    "fit": {
        "held_out": bool,
        "before": QUALITY,
        "after": QUALITY,
        "log_score_gain": NUMBER,
        "gain_se": NUMBER,
        "floor": {"onset_rmse_deg": NUMBER},
        "gap_closed": NUMBER,
        "simulator_rerun": {"engine": str, "before": dict, "after": dict},
    },
    "next_experiment": {"separates": [[str]], "plan": str, "runs": int, "why": str},
    "candidates_tried": int,
    "seconds": NUMBER,
    "versions": dict,
}
VERDICTS = {"supported", "not supported", "indistinguishable", "untestable"}


def check(value: Any, wanted: Any, where: str = "") -> None:
    if isinstance(wanted, dict):
        assert isinstance(value, dict), where
        assert set(wanted) <= set(value), where
        for name, part in wanted.items():
            check(value[name], part, f"{where}.{name}")
    elif isinstance(wanted, list):
        assert isinstance(value, list), where
        for number, part in enumerate(value):
            check(part, wanted[0], f"{where}[{number}]")
    else:
        assert isinstance(value, wanted), f"{where} is {value!r}"
        assert wanted is not int or not isinstance(value, bool), where


def told(diagnosis: Diagnosis) -> dict[str, Any]:
    """Returns the diagnosis as another program reads it: strictly JSON, without NaN."""
    return json.loads(json.dumps(as_json(diagnosis), allow_nan=False))


def test_a_finding_has_every_key() -> None:
    answer = told(grained().diagnosis)
    check(answer, CONTRACT)
    assert answer["verdict"] == "indistinguishable"
    effect = answer["effects"][0]
    assert set(effect["class"][:2]) == {"plate_anisotropy", "object_anisotropy"}
    for value in effect["parameters"].values():
        check(value, {"value": NUMBER, "sd": NUMBER, "unit": str})
    assert answer["located"][0]["phase"] == "onset"
    assert answer["located"][0]["windows"]


@pytest.mark.parametrize("runs", [0, 1, 19, 60])
def test_recordings_without_a_finding_have_every_key_too(runs: int) -> None:
    answer = told(recommended(examined(samples(runs=runs), catalogue()), catalogue()).diagnosis)
    plan = answer.pop("next_experiment")
    check(answer, {name: part for name, part in CONTRACT.items() if name != "next_experiment"})
    if plan is not None:
        check(plan, CONTRACT["next_experiment"])
    assert answer["verdict"] in VERDICTS
    assert (answer["verdict"] == "untestable") == (runs < 20)
    assert answer["effects"] == []


def test_effects_come_by_probability() -> None:
    chances = [effect["probability"] for effect in told(grained().diagnosis)["effects"]]
    assert chances == sorted(chances, reverse=True)


def test_what_the_figures_need_stays_out_of_the_json() -> None:
    place = Located(
        phase="onset", covariate="run", channel="onset", effect_size=0.5, p=0.01, runs=(1,),
        windows=(Stretch(run=1, from_ns=0, to_ns=1),), summary="s", curve=((0.0, 1.0, 2.0),),
    )  # fmt: skip
    answer = told(replace(grained().diagnosis, located=(place,)))
    assert "curve" not in answer["located"][0]
    assert not {"pictures", "channels", "spots_before"} & set(answer)
