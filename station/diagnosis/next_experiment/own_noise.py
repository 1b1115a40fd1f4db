"""Gains as a search has them, which estimates the noise anew with every candidate.

Scores give gains with the noise of the truth. A model that lacks the truth has larger residuals, and takes them for
noise; what it lays on a nuisance that stands far from its prior is no residual.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from station.diagnosis.inference.columns import Scores
from station.physics.contact import Array


def with_own_noise(scored: Scores, truth: int, candidates: Sequence[Sequence[int]], gains: Sequence[Array]) -> Array:
    """Returns twice the gains (candidates, draws) with each model's own noise.

    The truth is a column of `scored`, the candidates are sets of columns, and `gains` (candidates, draws) are twice
    theirs with the noise of the truth. The truth lies in n rows, where it makes a sum of squares L of unit noise. Of a
    gain G the share p is the priors', so (1 − p) G of L is explained, and twice the gain is

        p G + n ln[(1 + L / n) / (1 + (L − (1 − p) G) / n)].
    """
    rows = max(float(scored.rows[truth]), 1.0)
    data = float((np.diag(scored.information) - np.diag(scored.absorbed.resisted))[truth])
    shares = shares_of_priors(scored, truth, candidates)[:, None]
    explained = (1.0 - shares) * np.array(gains)
    left = np.maximum(data - explained, 0.0)
    return shares * np.array(gains) + rows * (np.log1p((left + explained) / rows) - np.log1p(left / rows))


def shares_of_priors(scored: Scores, truth: int, candidates: Sequence[Sequence[int]]) -> Array:
    """Returns the shares (candidates,), from 0 to 1, of the candidates' gains that they gain of the priors.

    The truth and the candidates are as above.
    """
    shares = np.zeros(len(candidates))
    for count in {len(one) for one in candidates}:
        indices = [index for index, one in enumerate(candidates) if len(one) == count]
        shares[indices] = _shares(scored, truth, np.array([candidates[index] for index in indices]))
    return shares


def _shares(scored: Scores, truth: int, chosen: NDArray[np.int64]) -> Array:
    """Returns the shares (m,) of candidates of the same number of columns `chosen` (m, k).

    They are computed all at once, as they are many.
    """
    among = chosen[:, :, None], chosen[:, None, :]
    seen, resisted = scored.information[chosen, truth], scored.absorbed.resisted
    inverse = np.linalg.pinv(scored.information[among], hermitian=True)
    size = (inverse @ seen[:, :, None])[:, :, 0]
    whole = (size * seen).sum(axis=1)
    of_priors = (size * (2.0 * resisted[chosen, truth] - (resisted[among] @ size[:, :, None])[:, :, 0])).sum(axis=1)
    gains = whole > 0.0
    return np.where(gains, np.clip(of_priors / np.where(gains, whole, 1.0), 0.0, 1.0), 0.0)
