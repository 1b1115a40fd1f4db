"""The single effect of the whole catalogue with the best BIC, by full fits, without a calibrated null or classes."""

from __future__ import annotations

import math
from typing import ClassVar

from station.diagnosis.inference.fit import Fit, fit
from station.physics.effect import Effect
from station.physics.model import Term
from tests.proof.judged import judged
from tests.proof.rivals import Answer, Rival, Table


class BestBic(Rival):
    """Bayesian information criterion (Schwarz 1978, Ann. Stat. 6, 461) over single terms."""

    name: ClassVar[str] = "best_bic"
    title: ClassVar[str] = "best single term by BIC"
    says_names: ClassVar[bool] = True
    says_places: ClassVar[bool] = False

    def answer(self, table: Table) -> Answer:
        """Names the best one if its BIC is better than the plain model's."""
        best: tuple[float, Effect, Fit] | None = None
        for effect in table.catalogue.values():
            if effect.layer == "numerics":
                continue
            fitted = _likeliest(table, effect)
            penalty = len(effect.parameters) * math.log(max(table.evidence.runs, 2))
            bic = 2 * (fitted.log_likelihood - table.plain.log_likelihood) - penalty
            if best is None or bic > best[0]:
                best = (bic, effect, fitted)
        if best is None or best[0] <= 0:
            return Answer(held=judged(table.evidence, table.plain, (), table.fold))
        _, effect, fitted = best
        return Answer(names=(effect.id,), held=judged(table.evidence, fitted, [effect], table.fold))


def _likeliest(table: Table, effect: Effect) -> Fit:
    """The likeliest fit from the starts of its shapes."""
    count = max((len(p.starts) for p in effect.parameters if p.is_shape), default=1)
    fits = list[Fit]()
    for number in range(count):
        values = {
            p.name: p.starts[min(number, len(p.starts) - 1)] if p.null is None else p.clipped(p.null + 0.1 * p.typical)
            for p in effect.parameters
        }
        start = table.plain.model.with_term(Term(effect, values))
        fits.append(fit(table.evidence, start, [effect], noise=table.plain.noise))
    return max(fits, key=lambda one: one.log_likelihood)
