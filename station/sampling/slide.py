"""A slide's readings: the mean attitude over the 300 ms up to its detection, and the onset fitted to its path."""

from __future__ import annotations

import math

import numpy as np

from station.friction.onset import Onset
from station.sampling.braking import before_foam, pushed
from station.sampling.no_slide import Seen, is_no_slide, last_at_rest
from station.sampling.plan import SlipPlan
from station.sampling.run import Run, Specimen
from station.sampling.tracks import Tracks
from station.sampling.unseen import are_away, may_have_met_foam
from station.signals.flags import UNRESOLVED


def read_slide(run: Run, *, tracks: Tracks, plan: SlipPlan) -> None:
    """Fills in the run's attitude, onset and its standard error, once an attitude after the detection is there."""
    averaged_from_ns = run.detect_ns - round(plan.average_s * 1e9)
    run.euler_rad = tracks.mean_euler_rad(from_ns=averaged_from_ns)
    since_ns = run.fitted_from_ns
    seen = tracks.seen(since_ns=since_ns, until_ns=run.detect_ns)
    onset = _onset(run, tracks, seen, since_ns=since_ns) if seen else None
    if onset is not None:
        run.slip_ns, run.onset_rad, run.onset_sigma_rad = onset.slip_ns, onset.angle_rad, onset.angle_sigma_rad
    else:
        # The paper's own number, and the step's width as its uncertainty.
        low, high = run.bracket_rad(run.detect_ns)
        run.onset_rad = tracks.mean_tilt_rad(from_ns=averaged_from_ns)
        run.onset_sigma_rad = (high - low) / math.sqrt(12.0)
        run.flags.append(UNRESOLVED)
    if _is_unseen(run, tracks, since_ns=since_ns):
        run.disturb("gap")
    if seen and tracks.geometry:
        m_per_px = tracks.geometry.mm_per_px * 1e-3
        if is_no_slide(seen, down=np.array(_downhill(run)), plan=plan, m_per_px=m_per_px):
            run.disturb("no_slide")


def mind_braking(run: Run, *, tracks: Tracks, plan: SlipPlan, specimen: Specimen) -> None:
    """Looks at what braked the block until the foam may have done so, which tells one that was pushed.

    Without foam in the rig's description nobody knows what stopped the block, and nothing is told where the plate has
    come back so slowly that its tilts as the block slid are no longer kept.
    """
    if run.censored or run.disturbed or tracks.geometry is None or not specimen.opening.walled:
        return
    seen = tracks.seen(since_ns=run.fitted_from_ns, until_ns=tracks.frame_ns)
    if seen is None or tracks.attitudes_ns(since_ns=0)[0] > seen.time_ns[0]:
        return
    # Where the mark looks too small the block may lie so much farther out.
    outline_m = tracks.outline_m(seen, side_m=math.sqrt(specimen.block_area_m2)) / (1.0 - run.off_scale)
    seen = seen.first(before_foam(seen, outline_m, specimen.opening, down=np.array(_downhill(run))))
    detected = seen.first(int(np.searchsorted(seen.time_ns, run.detect_ns, side="right")))
    if not len(detected.time_ns):
        return
    rest = last_at_rest(detected, plan=plan, m_per_px=tracks.geometry.mm_per_px * 1e-3)
    if pushed(seen, since=rest):
        run.disturb("no_slide")


def _onset(run: Run, tracks: Tracks, seen: Seen, *, since_ns: int) -> Onset | None:
    """Returns the onset that is fitted to the frames with the noise of the reference, or None."""
    variance = run.reference.variance_px2 if run.reference else ()
    sigma_px = math.sqrt(sum(variance) / len(variance)) if variance else 1.0
    return tracks.onset(seen, since_ns=since_ns, downhill=_downhill(run), sigma_px=sigma_px, scale_sigma=run.off_scale)


def _is_unseen(run: Run, tracks: Tracks, *, since_ns: int) -> bool:
    """Returns true if frames or attitudes are missing where they would tell when the block began to slide."""
    if run.reference is None or tracks.geometry is None:
        return False
    m_per_px = tracks.geometry.mm_per_px * 1e-3
    moved_px = tracks.moved_px(run.reference.corners_px, since_ns=since_ns, until_ns=run.detect_ns)
    if may_have_met_foam(
        [(stamp, m_per_px * px) for stamp, px in moved_px],
        from_ns=run.slip_ns or run.detect_ns,
        way_m=m_per_px * run.way_px,
        tilt_rad=run.onset_rad,
    ):
        return True
    attitudes_ns = tracks.attitudes_ns(since_ns=since_ns)
    return bool(run.slip_ns) and are_away(attitudes_ns, from_ns=run.slip_ns, to_ns=run.detect_ns)


def _downhill(run: Run) -> tuple[float, float]:
    """Returns the unit vector of the steepest way down, in the plate's frame."""
    beta = run.direction.azimuth_rad
    return math.sin(beta), -math.cos(beta)
