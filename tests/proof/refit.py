"""The true effects, refitted on the same runs beside tool and rivals, tell how much of the gap could be closed.

This runs after the key is open and never before. All are judged on runs that they have not seen, with the same folds:
by their onsets and slides, and by the tool's own likelihood.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from shared.rig import load_rig
from station.app.setting import setting_of
from station.app.work import write_json
from station.diagnosis.inference.fit import Fit, fit
from station.diagnosis.inference.level import levelled
from station.diagnosis.observations.build import evidence_of
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.predict.folds import FOLDS
from station.diagnosis.predict.held_out import HeldOut
from station.physics.catalogue import Catalogue, catalogue
from station.physics.contact import Array
from station.physics.effect import Effect
from station.physics.model import Model, Term
from station.recording.arrays import load_signals
from station.recording.reader import open_recording
from tests.proof.judged import errors, gain, judged
from tests.proof.rivals import Table, rival_named


@dataclass(frozen=True, kw_only=True)
class Refit:
    """A task of refitting: a case's true effects, what the tool named (its model's tables), and the rivals by name."""

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
    rig = task.case / "rig.toml"
    evidence = evidence_of(signals, setting_of(load_rig(rig) if rig.exists() else None))
    rng = np.random.default_rng(int(task.case.name[:8], 16) if _is_hex(task.case.name) else 1)
    fold = rng.permutation(np.arange(evidence.runs) % FOLDS)
    plain = fit(evidence, levelled(evidence, Model(mu_s=task.mu_s)), ())
    base = judged(evidence, plain, (), fold)
    written: dict[str, Any] = {"runs": int(np.isfinite(base.log_run).sum()), "plain": errors(base), "rivals": {}}
    true = [known[name] for name in task.true if name in known]
    if true and len(true) == len(task.true):
        held = oracle(evidence, plain, true, fold)
        written["oracle"] = gain(held, base) | errors(held)
    if task.said:
        held = _tool(evidence, plain, task.said, known, fold)
        written["tool"] = gain(held, base) | errors(held)
    table = Table(signals=signals, evidence=evidence, plain=plain, fold=fold, catalogue=known)
    for name in task.rivals:
        written["rivals"][name] = _rival(name, table, base)
    write_json(task.result, written)


def _is_hex(name: str) -> bool:
    return len(name) >= 8 and all(letter in "0123456789abcdef" for letter in name[:8])


def oracle(evidence: Evidence, plain: Fit, effects: Sequence[Effect], fold: Array) -> HeldOut:
    """Predictions by the true effects; of every start of their shapes the likeliest fit."""
    best: Fit | None = None
    for start in _starts(effects):
        model = plain.model
        for term in start:
            model = model.with_term(term)
        fitted = fit(evidence, model, effects, noise=plain.noise)
        if best is None or fitted.log_likelihood > best.log_likelihood:
            best = fitted
    assert best is not None
    return judged(evidence, best, effects, fold)


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
) -> HeldOut:
    model = plain.model
    for name, values in said.items():
        model = model.with_term(Term(known[name], dict(values)))
    effects = [known[name] for name in said]
    fitted = fit(evidence, model, effects, noise=plain.noise)
    return judged(evidence, fitted, effects, fold)


def _rival(name: str, table: Table, base: HeldOut) -> dict[str, Any]:
    began = time.monotonic()
    try:
        answer = rival_named(name).answer(table)
    except Exception as error:
        return {"fault": f"{type(error).__name__}: {error}"}
    told = gain(answer.held, base) | errors(answer.held) if answer.held is not None else {}
    return {
        **told,
        "names": list(answer.names),
        "place": list(answer.place) if answer.place else None,
        "seconds": time.monotonic() - began,
    }
