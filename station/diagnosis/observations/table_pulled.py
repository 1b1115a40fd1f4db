"""The channels of a table's rows whose friction was measured by pulling."""

from __future__ import annotations

import math

import numpy as np

from station.diagnosis.observations.moments import RunFacts
from station.diagnosis.observations.plate import Times
from station.diagnosis.observations.pulled import Pulled
from station.diagnosis.observations.series import travelled_of
from station.diagnosis.observations.table_rows import TableRows
from station.diagnosis.observations.table_states import azimuths_rad, moments_ns, places_m, rows_from
from station.physics.contact import Bools, Contact
from station.physics.reversals import SWINGS

UNKNOWN = 1e-3
"""The relative standard deviation of a coefficient that comes without one; its scatter is estimated anyway."""


def pulled_of(name: str, rows: TableRows, facts: RunFacts, mask: Bools) -> Pulled:
    """Returns the rows that a mask (n,) marks, as the channel of that name."""
    runs = np.flatnonzero(mask)
    chosen = rows.chosen(runs)
    contact = _contact(chosen, facts, runs)
    sigma = np.where(chosen.sigma > 0, chosen.sigma, UNKNOWN)
    given = rows_from(chosen, runs, sigma, contact)
    return Pulled(name, given, contact, chosen.coefficient, travelled_m=travelled_of(chosen))


def _contact(rows: TableRows, facts: RunFacts, runs: Times) -> Contact:
    """Returns level contacts (n,) that are pulled down the slope that they would have on a plate tilted about β."""
    zero, place_m = np.zeros(len(rows)), places_m(rows)
    down = azimuths_rad(rows) - math.pi / 2
    return Contact(
        run=facts.number[runs],
        moving=rows.speed_m_s > 0,
        way_rad=down,
        speed_m_s=rows.speed_m_s,
        x_m=place_m[:, 0],
        y_m=place_m[:, 1],
        yaw_rad=rows.of_samples("start_yaw_rad"),
        rest_s=np.asarray((moments_ns(rows) - facts.rest_ns[runs]) * 1e-9, dtype=np.float64),
        slid_s=zero,
        tilt_rad=zero,
        down_rad=down,
        rate_rad_s=np.zeros((len(rows), 3)),
        acceleration_rad_s2=np.zeros((len(rows), 3)),
        rising=np.ones(len(rows)),
        gone_rad=np.full(len(rows), np.inf),
        swing_rad=np.full((len(rows), SWINGS), np.inf),
        step_s=np.full(len(rows), 1e3),
        mount_rad=facts.mount_rad[runs],
        mass_kg=facts.mass_kg[runs],
        area_m2=facts.area_m2[runs],
        border_m=np.full(len(rows), np.inf),
        temperature_c=facts.temperature_c[runs],
        relative_humidity=facts.relative_humidity[runs],
        spare_m_s2=np.full(len(rows), np.nan),
    )
