"""Measures how far the blocks of a recording lay from the foam before their runs, for tables without the rig."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from shared.messages import Sample
from station.app.attached import attached_rig
from station.app.setting import setting_of
from station.recording.reader import open_recording


def free_of_foam_m(samples: Sequence[Sample], path: Path) -> dict[str, list[float]]:
    """Returns the column foam_free_m: the distance (m) of each block from the foam, 0 or less where it leans on it.

    It is nan where the place is unknown; the column is left out for a table, and where no rig file tells of a foam.
    """
    rig = attached_rig(open_recording(path)) if path.suffix == ".mcap" else None
    if rig is None or not samples:
        return {}
    place_m = np.array([(sample.start_x_m, sample.start_y_m) for sample in samples])
    noted = (place_m != 0.0).any(axis=1)
    free_m = np.where(noted, setting_of(rig).free_m(place_m), math.nan)
    return {"foam_free_m": free_m.tolist()} if np.isfinite(free_m).any() else {}
