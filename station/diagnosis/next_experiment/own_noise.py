"""Gains as a search has them, which estimates the noise anew with every candidate.

Scores give gains with the noise of the truth. A model that lacks the truth has larger residuals, and takes them for
noise; what it lays on a nuisance that stands far from its prior is no residual.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from station.diagnosis.inference.columns import Scores
from station.physics.contact import Array


def with_own_noise(scored: Scores, truth: int, candidates: Sequence[Sequence[int]], gains: Sequence[Array]) -> Array:
    """Twice the gains (candidates, draws) with each model's own noise.

    The truth is a column of `scored`, the candidates are sets of columns, and `gains` (candidates, draws) are twice
    theirs with the noise of the truth. The truth lies in n rows, where it makes a sum of squares L of unit noise. Of a
    gain G the share p is the priors', so (1 − p) G of L is explained, and twice the gain is

        p G + n ln[(1 + L / n) / (1 + (L − (1 − p) G) / n)].
    """
    rows = max(float(scored.rows[truth]), 1.0)
    data = float((np.diag(scored.information) - np.diag(scored.absorbed.resisted))[truth])
    shares = np.array([share_of_priors(scored, truth, one) for one in candidates])[:, None]
    explained = (1.0 - shares) * np.array(gains)
    left = np.maximum(data - explained, 0.0)
    return shares * np.array(gains) + rows * (np.log1p((left + explained) / rows) - np.log1p(left / rows))


def share_of_priors(scored: Scores, truth: int, columns: Sequence[int]) -> float:
    """The share, from 0 to 1, of what columns gain where the truth is another column, that they gain of the priors."""
    chosen, resisted = list(columns), scored.absorbed.resisted
    size = (
        np.linalg.pinv(scored.information[np.ix_(chosen, chosen)], hermitian=True) @ scored.information[chosen, truth]
    )
    whole = float(size @ scored.information[chosen, truth])
    of_priors = float(2.0 * size @ resisted[chosen, truth] - size @ resisted[np.ix_(chosen, chosen)] @ size)
    return min(max(of_priors / whole, 0.0), 1.0) if whole > 0.0 else 0.0
