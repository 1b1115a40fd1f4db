"""A slide's readings: the mean attitude over the 300 ms up to its detection, and the onset fitted to its path."""

from __future__ import annotations

import math

from station.sampling.plan import SlipPlan
from station.sampling.run import Run
from station.sampling.tracks import Tracks
from station.signals.flags import UNRESOLVED

_FITTED_NS = 3_000_000_000
"""The stretch of path before the detection that is fitted: it has a second and more of rest at any tilt rate."""


def read_slide(run: Run, *, tracks: Tracks, plan: SlipPlan) -> None:
    """Fills in the run's attitude, onset and its standard error, once an attitude after the detection is there."""
    averaged_from_ns = run.detect_ns - round(plan.average_s * 1e9)
    run.euler_rad = tracks.mean_euler_rad(from_ns=averaged_from_ns)
    beta = run.direction.azimuth_rad
    variance = run.reference.variance_px2 if run.reference else ()
    onset = tracks.onset(
        since_ns=max(run.tilt_ns, run.detect_ns - _FITTED_NS),
        detect_ns=run.detect_ns,
        downhill=(math.sin(beta), -math.cos(beta)),
        sigma_px=math.sqrt(sum(variance) / len(variance)) if variance else 1.0,
    )
    if onset is not None:
        run.slip_ns, run.onset_rad, run.onset_sigma_rad = onset.slip_ns, onset.angle_rad, onset.angle_sigma_rad
        return
    # The paper's own number, and the step's width as its uncertainty.
    low, high = run.bracket_rad(run.detect_ns)
    run.onset_rad = tracks.mean_tilt_rad(from_ns=averaged_from_ns)
    run.onset_sigma_rad = (high - low) / math.sqrt(12.0)
    run.flags.append(UNRESOLVED)
