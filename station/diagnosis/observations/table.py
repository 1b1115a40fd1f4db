"""Evidence from a table: onsets on a tilted plate, and friction that was measured by pulling, at rest or sliding."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from shared.messages import Sample
from station.diagnosis.observations.build import facts_of
from station.diagnosis.observations.channel import Channel, Rows, rows_of
from station.diagnosis.observations.evidence import Evidence, Setting
from station.diagnosis.observations.moments import Moments, RunFacts
from station.diagnosis.observations.onset_rows import sigma_of
from station.diagnosis.observations.onsets import Onsets
from station.diagnosis.observations.plate import Attitude, Times
from station.diagnosis.observations.pulled import SETTLING, Pulled
from station.diagnosis.observations.series import SETTLED, in_windows, settling, travelled_of
from station.diagnosis.observations.starts import FREE_M
from station.diagnosis.observations.table_rows import TableRows, mass_of
from station.physics.contact import Array, Bools, Contact
from station.physics.covariates import covariates_of
from station.signals.measured import Measured

APART_NS = 600_000_000_000
"""The interval between the invented times of runs whose table has none."""

UNKNOWN = 1e-3
"""The relative standard deviation of a coefficient that comes without one; its scatter is estimated anyway."""


def table_evidence(recorded: Measured | Sequence[Sample], setting: Setting) -> Evidence:
    """The evidence of a table's rows; what a row lacks has the columns' defaults."""
    table = recorded if isinstance(recorded, Measured) else Measured.of(recorded)
    rows = in_windows(TableRows.of(table))
    notes = list(_notes(table, rows))
    rows, leaned = _free(rows, setting)
    rows = rows if travelled_of(rows) is not None else rows.typical_first()
    if leaned:
        notes.append(f"{leaned} rows of blocks that lay against the foam were left out")
    facts = _facts(rows, setting)
    return Evidence(
        channels=tuple(_channels(rows, facts, setting)),
        run_number=(rows.number if rows.named_by_run else rows.row).astype(np.float64),
        facts=facts,
        total_runs=len(table),
        notes=tuple(notes),
        group=rows.group,
    )


def _notes(table: Measured, rows: TableRows) -> Iterator[str]:
    if not len(rows):
        yield "no row of the table has an onset angle between 0.02 and pi/2 rad, or a coefficient of friction above 0"
    elif rows.lost:
        yield f"{rows.lost} rows have no usable onset angle or coefficient and were left out"
    if len(rows) and len(rows) < rows.read:
        yield f"{rows.read} rows of a continuous record were averaged in {len(rows)} windows of equal slip"
    if len(rows) and not rows.ordered:
        yield "the table has no column run or time that varies, so nothing can be said of the order of its rows"
    if table.ignored:
        yield f"columns that nothing reads were left alone: {', '.join(table.ignored)}"


def _free(rows: TableRows, setting: Setting) -> tuple[TableRows, int]:
    """The rows without those of blocks that lay against the foam, which holds them, and the number of these."""
    noted = rows.more.column("foam_free_m")
    free_m = np.where(np.isfinite(noted), noted, setting.free_m(_places(rows)))
    leaned = ~rows.pulled & (free_m <= FREE_M)
    return rows.chosen(np.flatnonzero(~leaned)), int(leaned.sum())


def _facts(rows: TableRows, setting: Setting) -> RunFacts:
    facts = facts_of(rows.samples, setting)
    tilt = np.where(rows.pulled, 0.0, _tilt(rows))
    mass = np.where(np.isfinite(rows.load_n), mass_of(rows.load_n, tilt), facts.mass_kg)
    typical = float(np.median(tilt)) if len(rows) else 0.0
    rest_s = np.array([_rest_s(sample, typical) for sample in rows.samples])
    rest_ns = _moments_ns(rows) - np.round(rest_s * 1e9).astype(np.int64)
    return RunFacts(
        number=rows.number,
        rest_ns=rest_ns,
        mount_rad=facts.mount_rad,
        mass_kg=mass,
        area_m2=facts.area_m2,
        temperature_c=facts.temperature_c,
        relative_humidity=facts.relative_humidity,
    )


def _channels(rows: TableRows, facts: RunFacts, setting: Setting) -> Iterator[Channel]:
    """The onsets or the friction at rest, then the friction while sliding; only what there are rows of."""
    moving = rows.pulled & (rows.speed_m_s > 0)
    if (~rows.pulled).any():
        yield _onsets(rows, facts, setting, np.flatnonzero(~rows.pulled))
    unsettled = settling(rows)
    masks = {"onset": rows.pulled & ~moving, "along": moving & ~unsettled, SETTLING: moving & unsettled}
    for name, mask in masks.items():
        if mask.any():
            yield _pulled(name, rows, facts, mask)


# --- on a tilted plate -----------------------------------------------------------------------------------------------


def _onsets(rows: TableRows, facts: RunFacts, setting: Setting, places: Times) -> Onsets:
    chosen = rows.chosen(places)
    time_ns, place_m = _moments_ns(rows)[places], _places(chosen)
    moments = Moments(
        time_ns=time_ns,
        run=places,
        facts=facts,
        attitude=lambda delay_s: _attitude(chosen, delay_s),
        place_m=place_m,
        yaw_rad=np.array([sample.start_yaw_rad for sample in chosen.samples]),
        velocity_m_s=np.zeros((len(chosen), 2)),
        moving=np.zeros(len(chosen), dtype=np.bool_),
        slip_ns=time_ns,
        border_m=setting.free_m(place_m),
    )
    tilt = moments.reported.tilt_rad
    return Onsets(_rows(chosen, places, _sigma_rad(chosen) / (np.sin(tilt) * np.cos(tilt)), moments.reported), moments)


def _tilt(rows: TableRows) -> Array:
    """The tilts (n,) at the onsets."""
    return np.array([sample.onset_angle_rad for sample in rows.samples], dtype=np.float64)


def _sigma_rad(rows: TableRows) -> Array:
    return np.array([sigma_of(sample) for sample in rows.samples])


def _places(rows: TableRows) -> Array:
    return np.array([(sample.start_x_m, sample.start_y_m) for sample in rows.samples]).reshape(-1, 2)


def _moments_ns(rows: TableRows) -> Times:
    return np.where(rows.time_ns != 0, rows.time_ns, (np.arange(len(rows)) + 1) * APART_NS)


def _rest_s(sample: Sample, typical_rad: float) -> float:
    """The dwell, s, until the tilt reaches the typical onset; the run's own onset comes later with high friction."""
    rate = abs(sample.tilt_rate_rad_s)
    ramp = typical_rad / rate if rate > 0 else 0.0
    waited = (sample.start_ns - sample.rest_ns) * 1e-9 if sample.start_ns > sample.rest_ns > 0 else 0.0
    return max(sample.dwell_s + waited + ramp, 1e-3)


def _attitude(rows: TableRows, delay_s: float) -> Attitude:
    """The plate at the onsets, tilted about the axis at β: down the slope is (sin β, −cos β)."""
    rate = np.array([sample.tilt_rate_rad_s for sample in rows.samples])
    tilt, beta = _tilt(rows) - rate * delay_s, _azimuths(rows)
    gravity = np.column_stack([np.sin(tilt) * np.sin(beta), -np.sin(tilt) * np.cos(beta), -np.cos(tilt)])
    axis = np.column_stack([np.cos(beta), np.sin(beta), np.zeros(len(beta))])
    still: Array = np.zeros((len(rows), 3))
    return Attitude(gravity, axis * rate[:, None], still, np.ones(len(rows)), np.full(len(rows), 1e3))


def _azimuths(rows: TableRows) -> Array:
    return np.array([_azimuth(sample) for sample in rows.samples])


def _azimuth(sample: Sample) -> float:
    return sample.azimuth_rad if sample.azimuth_rad or sample.direction < 0 else sample.direction * math.pi / 2


# --- pulled ----------------------------------------------------------------------------------------------------------


def _pulled(name: str, rows: TableRows, facts: RunFacts, mask: Bools) -> Pulled:
    places = np.flatnonzero(mask)
    chosen = rows.chosen(places)
    contact = _contact(chosen, facts, places)
    sigma = np.where(chosen.sigma > 0, chosen.sigma, UNKNOWN)
    given = _rows(chosen, places, sigma, contact)
    return Pulled(name, given, contact, chosen.coefficient, travelled_m=travelled_of(chosen))


def _contact(rows: TableRows, facts: RunFacts, places: Times) -> Contact:
    """Level contacts (n,) that are pulled down the slope that they would have on a plate tilted about β."""
    zero, place_m = np.zeros(len(rows)), _places(rows)
    down = _azimuths(rows) - math.pi / 2
    return Contact(
        run=facts.number[places],
        moving=rows.speed_m_s > 0,
        way_rad=down,
        speed_m_s=rows.speed_m_s,
        x_m=place_m[:, 0],
        y_m=place_m[:, 1],
        yaw_rad=np.array([sample.start_yaw_rad for sample in rows.samples]),
        rest_s=np.asarray((_moments_ns(rows) - facts.rest_ns[places]) * 1e-9, dtype=np.float64),
        slid_s=zero,
        tilt_rad=zero,
        down_rad=down,
        rate_rad_s=np.zeros((len(rows), 3)),
        acceleration_rad_s2=np.zeros((len(rows), 3)),
        rising=np.ones(len(rows)),
        step_s=np.full(len(rows), 1e3),
        mount_rad=facts.mount_rad[places],
        mass_kg=facts.mass_kg[places],
        area_m2=facts.area_m2[places],
        border_m=np.full(len(rows), np.inf),
        temperature_c=facts.temperature_c[places],
        relative_humidity=facts.relative_humidity[places],
    )


def _rows(chosen: TableRows, places: Times, sigma: Array, contact: Contact) -> Rows:
    return rows_of(
        {
            "run": places,
            "from_ns": chosen.time_ns,
            "to_ns": chosen.time_ns,
            "sigma": sigma,
            "limit": np.array([sample.censored for sample in chosen.samples]),
        },
        {**covariates_of(contact), SETTLED: chosen.settled},
    )
