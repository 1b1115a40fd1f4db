"""Reads the contact from a table's rows: place, tilt, direction, moment, and the dwell before it."""

from __future__ import annotations

import math

import numpy as np

from shared.messages import Sample
from station.diagnosis.observations.channel import Rows, rows_of
from station.diagnosis.observations.plate import Times
from station.diagnosis.observations.series import SETTLED
from station.diagnosis.observations.table_rows import TableRows
from station.physics.contact import Array, Contact
from station.physics.covariates import covariates_of

APART_NS = 600_000_000_000
"""The interval between the invented times of runs whose table has none."""


def places_m(rows: TableRows) -> Array:
    """Returns the places (n, 2) on the plate, m."""
    return np.column_stack([rows.of_samples("start_x_m"), rows.of_samples("start_y_m")])


def azimuths_rad(rows: TableRows) -> Array:
    """Returns the azimuths β (n,) of the tilts' axes."""
    noted, direction = rows.of_samples("azimuth_rad"), rows.of_samples("direction")
    return np.where((noted != 0.0) | (direction < 0.0), noted, direction * math.pi / 2)


def moments_ns(rows: TableRows) -> Times:
    """Returns the times (n,) of the rows, invented where they are unknown."""
    return np.where(rows.time_ns != 0, rows.time_ns, (np.arange(len(rows)) + 1) * APART_NS)


def rests_s(rows: TableRows, typical_rad: float) -> Array:
    """Returns the dwells (n,), s, until the typical onset; a run's own comes later where its friction is high."""
    return np.array([_rest_s(sample, typical_rad) for sample in rows.samples])


def _rest_s(sample: Sample, typical_rad: float) -> float:
    rate = abs(sample.tilt_rate_rad_s)
    ramp = typical_rad / rate if rate > 0 else 0.0
    waited = (sample.start_ns - sample.rest_ns) * 1e-9 if sample.start_ns > sample.rest_ns > 0 else 0.0
    return max(sample.dwell_s + waited + ramp, 1e-3)


def rows_from(chosen: TableRows, runs: Times, sigma: Array, contact: Contact) -> Rows:
    """Returns a channel's rows of some runs.

    Args:
        chosen: the table's rows.
        runs: (n,) the indices of the rows' runs.
        sigma: (n,) the standard deviation of the measurement, in the residual's unit.
        contact: the contacts of the same rows.
    """
    return rows_of(
        {
            "run": runs,
            "from_ns": chosen.time_ns,
            "to_ns": chosen.time_ns,
            "sigma": sigma,
            "limit": chosen.of_samples("censored"),
        },
        {**covariates_of(contact), SETTLED: chosen.settled},
    )
