"""The result of a diagnosis as `--json` prints it: a contract to which is only added."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from station.diagnosis.result import Diagnosis, Differs, EffectFound, HeldOutGain, Value


def as_json(diagnosis: Diagnosis) -> dict[str, Any]:
    """Returns the `--json` contract; a number that does not exist is null."""
    fit = diagnosis.fit
    plan = diagnosis.next_experiment
    return _finite(
        {
            "recording": diagnosis.recording,
            "runs": {
                "total": diagnosis.total_runs,
                "used": diagnosis.used_runs,
                "held_out": diagnosis.held_out_runs,
                "counted": diagnosis.counted,
                "left_out": _reasons(diagnosis.left_out),
                "without_onset": _reasons(diagnosis.without_onset),
            },
            "baseline": {
                "simulator": diagnosis.simulator,
                "parameters": {"mu_s": _value(diagnosis.mu_s)} | {diagnosis.level: _value(diagnosis.mu_s)},
                "differs": [_differs(one) for one in diagnosis.differs],
            },
            "global_p": diagnosis.global_p,
            "located": [_without(place, "curve") for place in diagnosis.located],
            "verdict": diagnosis.verdict,
            "effects": [_effect(effect) for effect in diagnosis.effects],
            "other_probability": diagnosis.other_probability,
            "none_probability": diagnosis.none_probability,
            "fit": {
                "held_out": True,
                "before": asdict(fit.before),
                "after": asdict(fit.after),
                "log_score_gain": fit.log_score_gain,
                "gain_se": fit.gain_se,
                "floor": {"onset_rmse_deg": fit.floor_onset_deg},
                "gap_closed": fit.gap_closed,
                "gap_closed_se": fit.gap_closed_se,
                "ceiling": {"log_score": fit.ceiling_log_score},
                "nested": fit.nested,
                "simulator_rerun": dict(fit.simulator_rerun) or {"engine": "", "before": {}, "after": {}},
            },
            "next_experiment": None if plan is None else _without(plan, "changed"),
            "candidates_tried": diagnosis.candidates_tried,
            "seconds": diagnosis.seconds,
            "versions": dict(diagnosis.versions),
            "untestable": [{"id": name, "reason": why} for name, why in diagnosis.untestable.items()],
            "numerics": [dict(check) for check in diagnosis.numerics],
            "notes": list(diagnosis.notes),
            "model": dict(diagnosis.model),
        }
    )


def _value(value: Value) -> dict[str, Any]:
    return {"value": value.value, "sd": value.sd, "unit": value.unit, "interval90": list(value.interval90)}


def _reasons(runs: Mapping[str, int]) -> list[dict[str, Any]]:
    return [{"reason": why, "count": count} for why, count in runs.items()]


def _differs(one: Differs) -> dict[str, Any]:
    both = {"recording": one.recording, "simulation": one.simulation}
    sides = {side: {"value": value.value, "sd": value.sd} for side, value in both.items()}
    return {"name": one.name, **sides, "unit": one.recording.unit}


def _effect(effect: EffectFound) -> dict[str, Any]:
    return {
        "id": effect.id,
        "title": effect.title,
        "class": list(effect.class_ids),
        "probability": effect.probability,
        "verdict": effect.verdict,
        "parameters": {name: _value(value) | {"at_bound": value.at_bound} for name, value in effect.parameters.items()},
        "determined": [asdict(one) | {"interval90": list(one.known.interval90)} for one in effect.determined],
        "held_out": None if effect.held_out_gain is None else _held_out(effect.held_out_gain),
        "side": effect.side,
        "other_by": effect.other_by,
        "acting": [asdict(one) for one in effect.acting],
    }


def _held_out(gain: HeldOutGain) -> dict[str, Any]:
    return {
        "log_score_gain": gain.gain.value,
        "gain_se": gain.gain.sd,
        "path_gain_mm": 1e3 * gain.path.value,
        "path_gain_se_mm": 1e3 * gain.path.sd,
        "folds": gain.folds,
    }


def _without(part: Any, name: str) -> dict[str, Any]:
    """Returns the fields of a part of the answer but one, which is drawn and not told."""
    return {key: value for key, value in asdict(part).items() if key != name}


def _finite(value: Any) -> Any:
    """Returns the value with null for each nan and infinity, which JSON lacks, and with plain Python numbers."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(name): _finite(part) for name, part in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_finite(part) for part in value]
    if isinstance(value, np.generic):
        return _finite(value.item())
    return value
