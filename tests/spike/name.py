"""Names what a session has: `python -m tests.spike.name FILE`. Prints the posterior of the effects as JSON."""

from __future__ import annotations

import itertools
import json
import math
import sys
import time
from pathlib import Path

import numpy as np

from tests.spike import forward as f
from tests.spike.fit import Fit, Fitter, begin, start_of
from tests.spike.models import EFFECTS, NULL, SIGNED, STARTS, Model
from tests.spike.session import Session, read

NONE, ONE, TWO = 0.5, 0.35, 0.15
"""Prior probabilities of no effect, one and two; equal among the effects."""
TRIED, PARTNERS = 3, 2
"""So many effects of the best scores are fitted, alone and beside the best."""
CLAIMED = 0.9
DROPS = (0.01, 0.03, 0.09)


def name(session: Session) -> dict:
    """The posterior over the effects, the fits behind it, and what they cost."""
    begun, fitter = time.process_time(), Fitter(session)
    theta, slip = start_of(session)
    theta[f.MU] += _first_level(fitter, theta, slip)
    null = begin(NULL, theta, slip)
    fitter.look_wide(null)
    fitter.settle(null, 8)
    fits = {NULL: null}
    promised = sorted(_promises(fitter, null), key=lambda each: -each[0])
    for _, model, at in promised[:TRIED]:
        fits[model] = _fitted(fitter, null, model, at)
    drop = Model((("kinetic_drop", 0),))
    leapt = _leapt(fitter, null, drop)
    if drop not in fits or leapt.evidence > fits[drop].evidence:
        fits[drop] = leapt
    best = max((m for m in fits if len(m.names) == 1), key=lambda m: fits[m].evidence)
    if fits[best].evidence > null.evidence:
        _add_partners(fitter, fits, best, [each for each in promised if each[1] != best][:PARTNERS])
    chances = _chances(fits)
    top = max(fits, key=lambda m: chances[m])
    inclusion = {e: sum(p for m, p in chances.items() if e in m.effects) for e in EFFECTS}
    return {
        "runs": len(session.fact), "claimed": sorted(e for e, p in inclusion.items() if p >= CLAIMED),
        "inclusion": {e: round(p, 4) for e, p in sorted(inclusion.items(), key=lambda i: -i[1]) if p > 1e-3},
        "top": top.effects, "parameters": _numbers(fits[top]),
        "chi2": float(fits[top].told[:, 3].sum() / fits[top].told[:, 4].sum()),
        "fits": [[list(m.names), round(x.evidence - null.evidence, 2), round(x.decrement, 4)] for m, x in fits.items()],
        "all_converged": all(x.converged for x in fits.values()), "evaluations": fitter.evaluations,
        "seconds": round(time.process_time() - begun, 1),
    }  # fmt: skip


def _first_level(fitter: Fitter, theta, slip) -> float:
    fitter.session.fact[:, 20] = 2e-3
    fitter.runs(theta, slip)
    return float(np.median(fitter.told[:, 2]))


def _fitted(fitter: Fitter, base: Fit, model: Model, theta) -> Fit:
    fit = begin(model, theta, base.slip, base)
    fitter.settle(fit)
    return fit


def _leapt(fitter: Fitter, null: Fit, model: Model) -> Fit:
    """The fit of a drop, from the best of some typical sizes: no score shows it, to first order it is a later slip."""
    starts = []
    for size in DROPS:
        fit = begin(model, null.theta, null.slip)
        fit.theta[f.DROP] = size
        fitter.look_wide(fit)
        starts.append(fit)
    best = max(starts, key=lambda fit: fit.value)
    fitter.settle(best)
    return best


def _add_partners(fitter: Fitter, fits: dict[Model, Fit], best: Model, promised) -> None:
    """Fits the best model with each partner, which begins where it begins alone."""
    base = fits[best]
    for _, partner, at in promised:
        model = Model((*best.names, *partner.names))
        if len(set(model.effects)) < len(model.names):
            continue
        theta = base.theta.copy()
        own = [place for place in partner.priors if place not in NULL.priors]
        theta[own] = at[own]
        fits[model] = _fitted(fitter, base, model, theta)


def _promises(fitter: Fitter, base: Fit) -> list[tuple[float, Model, np.ndarray]]:
    """What each further effect would gain by one Newton step from the base, with its best shapes, and that step."""
    made = []
    for effect, variants in EFFECTS.items():
        if effect in base.model.effects:
            continue
        for variant, priors in enumerate(variants):
            model = Model((*base.model.names, (effect, variant)))
            shapes = [place for place in priors if place in STARTS]
            fitter.take_up(base)
            offers = []
            for values in itertools.product(*(STARTS[place] for place in shapes)):
                theta = base.theta.copy()
                theta[shapes] = values
                offers.append(_offer(fitter, begin(model, theta, base.slip, base), shapes))
            gain, theta = max(offers, key=lambda each: each[0])
            made.append((gain, model, theta))
    return made


def _offer(fitter: Fitter, fit: Fit, shapes: list[int]) -> tuple[float, np.ndarray]:
    free = [place for place in fit.free if place not in shapes]
    whole, fit.free = fit.free, tuple(free)
    slope, rows = fitter.scores(fit, fit.theta)
    fit.free = whole
    centred = rows - rows.mean(axis=0)
    priors = [fit.model.priors[place].sd for place in free]
    curve = centred.T @ centred + np.diag(1.0 / np.square(priors))
    step = np.linalg.solve(curve, slope)
    gain = 0.5 * float(slope @ step) - 0.5 * np.linalg.slogdet(curve)[1] - sum(math.log(sd) for sd in priors)
    theta = fit.theta.copy()
    best = -math.inf, theta
    for share in (1.0, 0.3):
        trial = theta.copy()
        trial[free] += share * step
        value = fitter.value(fit, trial)
        if value > best[0]:
            best = value, trial
    return gain, best[1] if best[0] > fitter.value(fit, theta) else theta


def _chances(fits: dict[Model, Fit]) -> dict[Model, float]:
    """Posterior probabilities of the models that were fitted; a wrong sign has none."""
    count = len(EFFECTS)
    priors = {0: NONE, 1: ONE / count, 2: TWO / (count * (count - 1) / 2)}
    logs = {}
    for model, fit in fits.items():
        wrong = any(fit.theta[SIGNED[name]] < 0 for name, _ in model.names if name in SIGNED)
        variants = math.prod(len(EFFECTS[name]) for name, _ in model.names)
        logs[model] = -math.inf if wrong else fit.evidence + math.log(priors[len(model.names)] / variants)
    top = max(logs.values())
    total = sum(math.exp(value - top) for value in logs.values())
    return {model: math.exp(value - top) / total for model, value in logs.items()}


def _numbers(fit: Fit) -> dict[str, list[float]]:
    names = {value: key for key, value in vars(f).items() if key.isupper() and isinstance(value, int)}
    return {names.get(p, f"PATCH{p - f.PATCH}"): [float(fit.theta[p]), fit.sd(p)] for p in fit.free}


if __name__ == "__main__":
    begun = time.process_time()
    session = read(Path(sys.argv[1]))
    reading = round(time.process_time() - begun, 1)
    print(json.dumps({"file": sys.argv[1], "reading": reading} | name(session)))
