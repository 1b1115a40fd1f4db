"""Sparse regression: PySINDy's sequentially thresholded least squares over functions of the covariates."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from station.physics.contact import Array, Bools
from tests.proof.rivals import Answer, Rival, Table, held_out_corrected
from tests.proof.terms import Terms, tables_of

THRESHOLDS = (0.02, 0.05, 0.1, 0.2, 0.4, 0.8)
"""The thresholds that are tried for a standardised coefficient, in shares of the residuals' standard deviation."""

LEAST = 1e-12
"""A share of the variance below which nothing is left."""

NAMES: Mapping[str, str] = {
    "speed": "viscous", "speed:log": "rate_strengthening", "speed:exp": "stribeck", "dwell": "contact_aging",
    "run": "wear", "run:square": "wear", "load": "load_dependence", "direction:1": "platform_level",
    "slide_to_grain:1": "one_way_friction", "slide_to_grain:2": "plate_anisotropy",
    "slide_to_block:2": "object_anisotropy", "yaw:1": "uneven_contact", "x": "friction_patch", "y": "friction_patch",
    "x:square": "friction_patch", "y:square": "friction_patch", "tilt_rate": "clock_offset",
}  # fmt: skip
"""The effect by which a reader would call each term, which is as near to the effect's law as the library comes."""

SEEN: Mapping[str, str] = {"rest": "presliding", "plate": "camera_sag"}
"""The names a reader would give to anything that moves the block, or the plate's own marks, before a slide."""


class PySindy(Rival):
    """STLSQ (Brunton, Proctor, Kutz 2016, PNAS 113, 3932), the threshold by BIC; the name is its largest term's."""

    name: ClassVar[str] = "pysindy"
    title: ClassVar[str] = "sparse regression (PySINDy)"
    says_names: ClassVar[bool] = True
    says_places: ClassVar[bool] = True
    needs: ClassVar[str] = "pysindy"

    def answer(self, table: Table) -> Answer:
        """Terms of all runs for name and place; held-out scores with terms chosen and fitted without each fold."""
        everything = np.ones(table.evidence.runs, dtype=np.bool_)
        tables = tables_of(table)
        largest: tuple[float, Terms, int] | None = None
        for terms in tables:
            shares = np.abs(sparse(terms, everything)) / _spread(terms)
            number = int(np.argmax(shares)) if len(shares) else 0
            if len(shares) and shares[number] > 0 and (largest is None or shares[number] > largest[0]):
                largest = (float(shares[number]), terms, number)
        by_channel = {terms.channel: terms for terms in tables}

        def predict(channel: str, train: Bools) -> Array:
            return by_channel[channel].columns @ sparse(by_channel[channel], train)

        held = held_out_corrected(table, by_channel, predict)
        if largest is None:
            return Answer(held=held)
        _, terms, number = largest
        name = SEEN.get(terms.channel) or NAMES.get(terms.names[number], "other")
        return Answer(names=(name,), place=(terms.phase, terms.covariates[number]), held=held)


def _spread(terms: Terms) -> float:
    """The residuals' standard deviation."""
    return max(float(np.std(terms.residual[terms.known])), 1e-12)


def sparse(terms: Terms, train: Bools) -> Array:
    """Coefficients (k,) of the rows of some runs, most of them 0."""
    rows = train[terms.run] & terms.known
    best = (math.inf, np.zeros(terms.columns.shape[1]))
    columns, residual = terms.columns[rows], terms.residual[rows] - np.mean(terms.residual[rows])
    runs, scale = max(len(np.unique(terms.run[rows])), 2), _spread(terms)
    for threshold in THRESHOLDS:
        found = scale * _stlsq(columns, residual / scale, threshold)
        left = float(np.mean((residual - columns @ found) ** 2)) / scale**2
        # The rows of a slide are not independent: runs count, not rows.
        bic = runs * math.log(max(left, LEAST)) + np.count_nonzero(found) * math.log(runs)
        if bic < best[0]:
            best = (bic, found)
    empty = runs * math.log(max(float(np.mean(residual**2)) / scale**2, LEAST))
    return best[1] if best[0] < empty else np.zeros(terms.columns.shape[1])


def _stlsq(columns: Array, residual: Array, threshold: float) -> Array:
    import pysindy  # noqa: PLC0415  (a package that may be missing)  # pyright: ignore[reportMissingImports] (optional)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it warns when no term is left, which is an answer
        optimizer: Any = pysindy.STLSQ(threshold=threshold, alpha=1e-3)
        optimizer.fit(columns, residual[:, None])
    return np.asarray(optimizer.coef_, dtype=np.float64).ravel()
