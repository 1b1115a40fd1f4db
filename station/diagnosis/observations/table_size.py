"""Memory that a table's diagnosis takes: rows of one group share their friction, and each pair of them a covariance."""

from __future__ import annotations

import numpy as np

from shared.errors import UserError

Index = np.ndarray[tuple[int], np.dtype[np.int64]]

ROW_BYTES = 10_500
"""Memory of a row: 459, 672 and 1041 MB for 18 500, 37 000 and 74 000 rows of direction and onset_angle_rad, 265 MB of
which none of the rows need (`/usr/bin/time -v station diagnose TABLE`)."""

PAIR_BYTES = 16
"""Memory of a pair of rows of one group: 8 bytes in the factors of the covariance (`Whitening`), and a search holds
those before a step and after it. Of 10 000 rows in 7 groups, 14 million pairs, a diagnosis took 655 MB."""

MOST_BYTES = 700_000_000
"""The most that rows and pairs may take: with what every diagnosis takes, 265 MB, it stays below 1 GB."""


def require_room(group: Index | None, rows: int) -> None:
    """Refuses rows whose diagnosis would not fit into memory; `group` (rows,) numbers their groups, None without any.

    Raises:
        UserError: if it would take more than MOST_BYTES.
    """
    sizes = np.ones(rows) if group is None else np.bincount(group).astype(np.float64)
    if ROW_BYTES * rows + PAIR_BYTES * float(sizes @ sizes) > MOST_BYTES:
        raise UserError(
            f"Expected a table whose diagnosis takes less than 1 GB, got {rows} rows in {len(sizes)} groups, the "
            f"largest of {sizes.max():.0f}: rows of one group share their friction, and each pair of them takes "
            f"{PAIR_BYTES} bytes; keep fewer rows of each group, or split the table"
        )
