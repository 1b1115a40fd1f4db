"""Measures how much of the gap could be closed at all: the true effects, refitted, beside tool and rivals.

This runs after the key is open and never before. All are judged by the tool's own likelihood, each run by a fit that
has not seen it, with the same folds.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from shared.rig import load_rig
from station.diagnosis.inference.fit import Fit, fit, levelled
from station.diagnosis.observations.build import evidence_of
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.predict.folds import FOLDS
from station.diagnosis.predict.held_out import held_out
from station.physics.catalogue import Catalogue, catalogue
from station.physics.contact import Array
from station.physics.effect import Effect
from station.physics.model import Model, Term
from station.prove.rivals import Table, rival_named
from station.prove.trial import Tool
from station.prove.workers import write_json
from station.recording.arrays import load_signals
from station.recording.reader import open_recording


@dataclass(frozen=True, kw_only=True)
class Refit:
    """What to refit: a case's true effects, what the tool named (its model's tables), and the rivals by name."""

    tool: Tool
    case: Path
    result: Path
    true: tuple[str, ...]
    said: Mapping[str, Mapping[str, float]]
    mu_s: float
    rivals: tuple[str, ...]


def run_refit(task: Refit) -> None:
    """Fits and writes the held-out scores per run: `plain`, `oracle`, `tool`, and each rival's answer."""
    known = catalogue()
    signals = load_signals(open_recording(task.case / "session.mcap"))
    evidence = evidence_of(signals, task.tool.setting(load_rig(task.case / "rig.toml")))
    rng = np.random.default_rng(int(task.case.name[:8], 16) if _is_hex(task.case.name) else 1)
    fold = rng.permutation(np.arange(evidence.runs) % FOLDS)
    plain = fit(evidence, levelled(evidence, Model(mu_s=task.mu_s)), ())
    base = held_out(evidence, plain, (), fold).log_run
    written: dict[str, Any] = {"runs": int(np.isfinite(base).sum()), "plain": mean(base), "rivals": {}}
    true = [known[name] for name in task.true if name in known]
    if true and len(true) == len(task.true):
        written["oracle"] = gain(oracle(evidence, plain, true, fold), base)
    if task.said:
        written["tool"] = gain(_tool(evidence, plain, task.said, known, fold), base)
    table = Table(signals=signals, evidence=evidence, plain=plain, fold=fold, catalogue=known)
    for name in task.rivals:
        written["rivals"][name] = _rival(name, table, base)
    write_json(task.result, written)


def _is_hex(name: str) -> bool:
    return len(name) >= 8 and all(letter in "0123456789abcdef" for letter in name[:8])


def oracle(evidence: Evidence, plain: Fit, effects: Sequence[Effect], fold: Array) -> Array:
    """Held-out log densities (runs,) of the true effects; of every start of their shapes the likeliest fit."""
    best: Fit | None = None
    for start in _starts(effects):
        model = plain.model
        for term in start:
            model = model.with_term(term)
        fitted = fit(evidence, model, effects, noise=plain.noise)
        if best is None or fitted.log_likelihood > best.log_likelihood:
            best = fitted
    assert best is not None
    return held_out(evidence, best, effects, fold).log_run


def _starts(effects: Sequence[Effect]) -> list[list[Term]]:
    """All effects at a tenth of their typical size, with the n-th start of every shape."""
    count = max((len(p.starts) for effect in effects for p in effect.parameters if p.is_shape), default=1)
    return [[Term(effect, _start(effect, number)) for effect in effects] for number in range(count)]


def _start(effect: Effect, number: int) -> dict[str, float]:
    return {
        p.name: p.starts[min(number, len(p.starts) - 1)] if p.null is None else p.clipped(p.null + 0.1 * p.typical)
        for p in effect.parameters
    }


def _tool(
    evidence: Evidence, plain: Fit, said: Mapping[str, Mapping[str, float]], known: Catalogue, fold: Array
) -> Array:
    model = plain.model
    for name, values in said.items():
        model = model.with_term(Term(known[name], dict(values)))
    effects = [known[name] for name in said]
    fitted = fit(evidence, model, effects, noise=plain.noise)
    return held_out(evidence, fitted, effects, fold).log_run


def _rival(name: str, table: Table, base: Array) -> dict[str, Any]:
    began = time.monotonic()
    try:
        answer = rival_named(name).answer(table)
    except Exception as error:
        return {"fault": f"{type(error).__name__}: {error}"}
    told = gain(answer.log_run, base) if answer.log_run is not None else {}
    return {
        **told,
        "names": list(answer.names),
        "place": list(answer.place) if answer.place else None,
        "seconds": time.monotonic() - began,
    }


def gain(log_run: Array, base: Array) -> dict[str, float]:
    """The mean gain of a held-out run over the plain model, in log density, with its standard error."""
    known = np.isfinite(log_run) & np.isfinite(base)
    each = log_run[known] - base[known]
    if len(each) < 2:
        return {"gain": math.nan, "se": math.nan}
    return {"gain": float(each.mean()), "se": float(each.std(ddof=1) / math.sqrt(len(each)))}


def mean(values: Array) -> float:
    """The mean of what is known."""
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else math.nan
