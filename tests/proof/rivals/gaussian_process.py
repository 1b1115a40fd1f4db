"""A free discrepancy: a Gaussian process over all covariates beside mu (Kennedy & O'Hagan 2001, JRSS B 63, 425)."""

from __future__ import annotations

import warnings
from typing import Any, ClassVar

import numpy as np
from scipy.optimize import minimize

from station.diagnosis.observations.plate import Times
from station.physics.contact import Array, Bools
from tests.proof.rivals import Answer, Rival, Table, held_out_corrected
from tests.proof.terms import Terms, tables_of

SCALES_FROM, MOST_ROWS = 200, 500
"""Rows that the length scales are found on, and that a prediction rests on; a Gaussian process is cubic in them."""

SEED = 3
LEAST = 0.02
"""A share of the residuals' variance below which nothing is said to matter."""

_STEPS = 30


class GaussianProcess(Rival):
    """One length scale for every term; it names nothing, but says by permutation which covariate matters most.

    The length scales are found once on rows of all runs (a little in its favour), predictions without each fold.
    """

    name: ClassVar[str] = "gaussian_process"
    title: ClassVar[str] = "Gaussian-process discrepancy (scikit-learn)"
    says_names: ClassVar[bool] = False
    says_places: ClassVar[bool] = True
    needs: ClassVar[str] = "sklearn"

    def answer(self, table: Table) -> Answer:
        """The most important covariate, and held-out scores."""
        rng = np.random.default_rng(SEED)
        tables = [terms for terms in tables_of(table) if terms.known.sum() >= 20 and terms.columns.shape[1]]
        kernels = [length_scales(terms, rng) for terms in tables]
        ranked = [important(terms, kernel, rng) for terms, kernel in zip(tables, kernels, strict=True)]
        best = max(ranked, key=lambda one: one[0], default=None)

        pairs = {terms.channel: (terms, kernel) for terms, kernel in zip(tables, kernels, strict=True)}

        def predict(channel: str, train: Bools) -> Array:
            terms, kernel = pairs[channel]
            return _predicted(terms, kernel, train[terms.run], rng)

        held = held_out_corrected(table, pairs, predict)
        return Answer(place=best[1] if best and best[0] > LEAST else None, held=held)


def _chosen(rows: Bools, most: int, rng: np.random.Generator) -> Times:
    places: Times = np.flatnonzero(rows).astype(np.int64)
    return places if len(places) <= most else np.sort(rng.choice(places, most, replace=False))


def length_scales(terms: Terms, rng: np.random.Generator) -> Any:
    """The kernel with the likeliest length scales, amplitude and noise."""
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel  # noqa: PLC0415  (may be missing)  # pyright: ignore[reportMissingImports] (optional)

    rows = _chosen(terms.known, SCALES_FROM, rng)
    size = terms.columns.shape[1]
    ard: Any = np.full(size, 3.0)
    kernel = ConstantKernel(0.3, (1e-3, 1e2)) * RBF(ard, (0.3, 1e3)) + WhiteKernel(0.7, (1e-3, 1e1))
    model = _model(kernel, optimizer=_few_steps)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a length scale at its bound is an answer: the term does not matter
        model.fit(terms.columns[rows], terms.residual[rows])
    return model.kernel_


def _model(kernel: Any, *, optimizer: Any) -> Any:
    from sklearn.gaussian_process import GaussianProcessRegressor  # noqa: PLC0415  (may be missing)  # pyright: ignore[reportMissingImports] (optional)

    return GaussianProcessRegressor(kernel, normalize_y=True, optimizer=optimizer, alpha=1e-8)


def _few_steps(objective: Any, start: Array, bounds: Array) -> tuple[Array, float]:
    found = minimize(objective, start, jac=True, bounds=bounds, method="L-BFGS-B", options={"maxiter": _STEPS})
    return found.x, float(found.fun)


def _fitted(terms: Terms, kernel: Any, train: Bools, rng: np.random.Generator) -> Any:
    rows = _chosen(train & terms.known, MOST_ROWS, rng)
    return _model(kernel, optimizer=None).fit(terms.columns[rows], terms.residual[rows])


def _predicted(terms: Terms, kernel: Any, train: Bools, rng: np.random.Generator) -> Array:
    model = _fitted(terms, kernel, train, rng)
    predicted: Array = model.predict(terms.columns)
    return predicted


def important(terms: Terms, kernel: Any, rng: np.random.Generator) -> tuple[float, tuple[str, str]]:
    """The covariate whose shuffling changes predictions most: the share of the residuals' variance, and the place."""
    model = _fitted(terms, kernel, np.ones(len(terms.run), dtype=np.bool_), rng)
    rows = _chosen(terms.known, MOST_ROWS, rng)
    columns = terms.columns[rows]
    before = model.predict(columns)
    changes: dict[str, float] = {}
    order = rng.permutation(len(columns))
    for name in dict.fromkeys(terms.covariates):
        mine = [number for number, covariate in enumerate(terms.covariates) if covariate == name]
        shuffled = columns.copy()
        shuffled[:, mine] = columns[order][:, mine]
        changes[name] = float(np.mean((model.predict(shuffled) - before) ** 2) / np.var(terms.residual[rows]))
    name = max(changes, key=lambda one: changes[one])
    return changes[name], (terms.phase, name)
