"""Evidence from a table of samples, by their onsets alone: other rigs' measurements, or sessions without paths."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from shared.messages import Sample
from station.diagnosis import thresholds
from station.diagnosis.observations.build import facts_of
from station.diagnosis.observations.channel import rows_of
from station.diagnosis.observations.evidence import Evidence, Setting
from station.diagnosis.observations.moments import Moments
from station.diagnosis.observations.onset_rows import sigma_of
from station.diagnosis.observations.onsets import Onsets
from station.diagnosis.observations.plate import Attitude
from station.physics.contact import Array
from station.physics.covariates import covariates_of

APART_NS = 600_000_000_000
"""The interval between the invented times of runs whose table has none."""


def table_evidence(samples: Sequence[Sample], setting: Setting) -> Evidence:
    """The onsets of a table's rows; a row without run number, times or places has the columns' defaults."""
    usable = [sample for sample in samples if thresholds.LEAST_TILT_RAD < sample.onset_angle_rad < math.pi / 2]
    if not usable:
        return Evidence(
            channels=(), run_number=np.zeros(0), facts=facts_of([], setting), total_runs=len(samples),
            notes=("no row of the table has an onset angle between 0.02 and pi/2 rad",),
        )  # fmt: skip
    numbered = [sample.run for sample in usable]
    if len(set(numbered)) < len(numbered):
        usable = [replace(sample, run=place) for place, sample in enumerate(usable)]
    facts = facts_of(usable, setting)
    typical = float(np.median([sample.onset_angle_rad for sample in usable]))
    time_ns = np.array([_time_ns(sample, place) for place, sample in enumerate(usable)], dtype=np.int64)
    rest_s = np.array([_rest_s(sample, typical) for sample in usable])
    facts = replace(facts, rest_ns=time_ns - np.round(rest_s * 1e9).astype(np.int64))
    place_m = np.array([(sample.start_x_m, sample.start_y_m) for sample in usable])
    moments = Moments(
        time_ns=time_ns,
        run=np.arange(len(usable)),
        facts=facts,
        attitude=lambda delay_s: _attitude(usable, delay_s),
        place_m=place_m,
        yaw_rad=np.array([sample.start_yaw_rad for sample in usable]),
        velocity_m_s=np.zeros((len(usable), 2)),
        moving=np.zeros(len(usable), dtype=np.bool_),
        slip_ns=time_ns,
        border_m=setting.opening_radius_m - np.hypot(place_m[:, 0], place_m[:, 1]),
    )
    tilt = moments.reported.tilt_rad
    sigma = np.array([sigma_of(sample) for sample in usable]) / (np.sin(tilt) * np.cos(tilt))
    rows = rows_of(
        {
            "run": moments.run,
            "from_ns": time_ns,
            "to_ns": time_ns,
            "sigma": sigma,
            "limit": np.array([sample.censored for sample in usable]),
        },
        covariates_of(moments.reported),
    )
    lost = len(samples) - len(usable)
    return Evidence(
        channels=(Onsets(rows, moments),),
        run_number=np.array([float(sample.run) for sample in usable]),
        facts=facts,
        total_runs=len(samples),
        notes=(f"{lost} rows have no usable onset angle and were left out",) if lost else (),
    )


def _time_ns(sample: Sample, place: int) -> int:
    return sample.slip_ns or sample.detect_ns or (place + 1) * APART_NS


def _rest_s(sample: Sample, typical_rad: float) -> float:
    """The dwell, s, until the tilt reaches the typical onset; the run's own onset comes later with high friction."""
    rate = abs(sample.tilt_rate_rad_s)
    ramp = typical_rad / rate if rate > 0 else 0.0
    waited = (sample.start_ns - sample.rest_ns) * 1e-9 if sample.start_ns > sample.rest_ns > 0 else 0.0
    return max(sample.dwell_s + waited + ramp, 1e-3)


def _attitude(samples: Sequence[Sample], delay_s: float) -> Attitude:
    """The plate at the onsets, tilted about the axis at β: down the slope is (sin β, −cos β)."""
    rate = np.array([sample.tilt_rate_rad_s for sample in samples])
    tilt = np.array([sample.onset_angle_rad for sample in samples]) - rate * delay_s
    beta = np.array([_azimuth(sample) for sample in samples])
    gravity = np.column_stack([np.sin(tilt) * np.sin(beta), -np.sin(tilt) * np.cos(beta), -np.cos(tilt)])
    axis = np.column_stack([np.cos(beta), np.sin(beta), np.zeros(len(beta))])
    still: Array = np.zeros((len(samples), 3))
    return Attitude(gravity, axis * rate[:, None], still, np.ones(len(samples)), np.full(len(samples), 1e3))


def _azimuth(sample: Sample) -> float:
    return sample.azimuth_rad if sample.azimuth_rad or sample.direction < 0 else sample.direction * math.pi / 2
