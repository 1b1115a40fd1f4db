"""The onsets of a table's rows on a tilted plate."""

from __future__ import annotations

import numpy as np

from station.diagnosis.observations.moments import Moments, RunFacts
from station.diagnosis.observations.onset_rows import sigma_of
from station.diagnosis.observations.onsets import Onsets
from station.diagnosis.observations.plate import Attitude, Times
from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.table_rows import TableRows
from station.diagnosis.observations.table_states import azimuths_rad, moments_ns, places_m, rows_from
from station.physics.contact import Array
from station.physics.reversals import SWINGS


def onsets_of(rows: TableRows, facts: RunFacts, setting: Setting, runs: Times) -> Onsets:
    """Returns the onsets of the rows with the indices `runs` (m,), which are those of their runs as well."""
    chosen = rows.chosen(runs)
    time_ns, place_m = moments_ns(rows)[runs], places_m(chosen)
    moments = Moments(
        time_ns=time_ns,
        run=runs,
        facts=facts,
        attitude=lambda delay_s: _attitude(chosen, delay_s),
        place_m=place_m,
        yaw_rad=chosen.of_samples("start_yaw_rad"),
        border_m=setting.free_m(place_m),
    )
    tilt = moments.reported.tilt_rad
    return Onsets(
        rows_from(chosen, runs, _sigma_rad(chosen) / (np.sin(tilt) * np.cos(tilt)), moments.reported), moments
    )


def _sigma_rad(rows: TableRows) -> Array:
    return np.array([sigma_of(sample) for sample in rows.samples])


def _attitude(rows: TableRows, delay_s: float) -> Attitude:
    """Returns the plate at the onsets, tilted about the axis at β: down the slope is (sin β, −cos β)."""
    rate = rows.of_samples("tilt_rate_rad_s")
    tilt, beta = rows.of_samples("onset_angle_rad") - rate * delay_s, azimuths_rad(rows)
    gravity = np.column_stack([np.sin(tilt) * np.sin(beta), -np.sin(tilt) * np.cos(beta), -np.cos(tilt)])
    axis = np.column_stack([np.cos(beta), np.sin(beta), np.zeros(len(beta))])
    still: Array = np.zeros((len(rows), 3))
    alike, unknown = np.ones(len(rows)), np.full((len(rows), SWINGS), np.inf)
    return Attitude(gravity, axis * rate[:, None], still, alike, np.inf * alike, unknown, 1e3 * alike)
