"""The angle between a recording's slides and the steepest way down."""

from __future__ import annotations

import numpy as np

from shared.vectors import columns
from station.diagnosis.observations.channel import ALONG, ONSET
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.slides import Along
from station.diagnosis.observations.windows import WEIGHTS
from station.signals.downhill import usual_rad


def off_downhill_rad(evidence: Evidence) -> float:
    """Returns how far, rad, the blocks of most runs with an onset slide from the steepest way down; 0 without any.

    A block without an onset may have been thrown.
    """
    along, onset = evidence.channel(ALONG), evidence.channel(ONSET)
    if not isinstance(along, Along) or onset is None:
        return 0.0
    contact, run = along.contact, np.repeat(along.rows.run, len(WEIGHTS))
    chosen = np.isin(run, onset.rows.run[~onset.rows.limit])
    _, which = np.unique(run[chosen], return_inverse=True)
    way, down = (
        columns(*(np.bincount(which, axis).astype(np.float64) for axis in each[chosen].T))
        for each in (contact.way, contact.down)
    )
    return usual_rad(way, down)
