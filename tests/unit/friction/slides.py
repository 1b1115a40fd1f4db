"""Slides whose onset is known exactly, as a camera and an arm would report them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from station.friction.onset import Onset, estimate_onset
from station.simulators import slider

FLOATS = NDArray[np.float64]
PX_PER_M = 6000.0
FRAME_S = 1 / 90
ATTITUDE_S = 1 / 125
STEP_DEG = 1.35
HOLD_S = 0.1
KEPT_S = 3.0
"""The part of the path before the detection that a session fits."""
_LOW_DEG, _HIGH_DEG = 4 * STEP_DEG, 30 * STEP_DEG
_GRID_S = 2e-4
_GONE_S = 2.0
"""A slide is followed for so long, s: the paper's rule, which waits for seven mm, sees the slowest within a second."""


@cache
def staircase(rate_deg_s: float, *, ramp: Literal["linear", "smooth"]) -> tuple[FLOATS, FLOATS]:
    """Times (s) and tilts (rad) of a session's steps; a smooth ramp stays below `rate_deg_s` and 1 rad/s²."""
    travel = STEP_DEG / rate_deg_s
    if ramp == "smooth":  # the peaks of 10 s³ − 15 s⁴ + 6 s⁵: 1.875 of the mean rate, 5.78 of travel over time squared
        travel = max(1.875 * travel, math.sqrt(5.78 * math.radians(STEP_DEG)))
    count = round((_HIGH_DEG - _LOW_DEG) / STEP_DEG)
    t = np.arange(0.0, count * (travel + HOLD_S), _GRID_S)
    step, within = np.divmod(t, travel + HOLD_S)
    share = np.clip(within / travel, 0.0, 1.0)
    if ramp == "smooth":
        share = share**3 * (10 - 15 * share + 6 * share**2)
    return t, np.radians(_LOW_DEG + STEP_DEG * (step + share))


@dataclass(frozen=True, kw_only=True)
class Slide:
    """An exact slide: its tilt over time, its onset, and how far it has gone."""

    time_s: FLOATS
    tilt_rad: FLOATS
    onset_s: float
    onset_rad: float
    path_m: FLOATS
    along: float = 1.0

    def detection_s(self, *, sag_px: float = 0.0) -> float:
        """Returns the time at which the paper's rule, 10 + θ pixels, sees it."""
        seen = np.abs(self.path_m * PX_PER_M + sag_px * np.sin(self.tilt_rad))
        return float(self.time_s[np.argmax(seen > 10 + np.degrees(self.tilt_rad))])


def slide(
    onset_rad: float,
    *,
    rate_deg_s: float,
    ramp: Literal["linear", "smooth"] = "smooth",
    drop: float = 0.0,
    along: float = 1.0,
) -> Slide:
    """A block that starts at `onset_rad` and then has mu_k = (1 − drop) mu_s, by quadrature on a 0.2 ms grid.

    It starts at the axis about which the plate turns. What moves away from there on a turning plate is pulled and
    lifted, which needs its way: found in a few rounds, each of which changes it a hundred times less.
    """
    t, tilt = staircase(rate_deg_s, ramp=ramp)
    first = int(np.argmax(tilt >= onset_rad))
    t, tilt = t[: first + round(_GONE_S / _GRID_S)], tilt[: first + round(_GONE_S / _GRID_S)]
    onset_s = float(np.interp(onset_rad, tilt[first - 1 : first + 1], t[first - 1 : first + 1]))
    # The onset itself is a point of the grid: the pull may jump there.
    t = np.insert(t, first, onset_s)
    tilt = np.insert(tilt, first, onset_rad)
    mu = (1 - drop) * along * math.tan(onset_rad)
    sliding, steep = t[first:], tilt[first:]
    rate = np.gradient(tilt[first - 1 :], t[first - 1 :])[1:]
    pull = 9.81 * (along * np.sin(steep) - mu * np.cos(steep))
    gone = np.zeros_like(pull)
    for _ in range(4):
        ahead = along * gone
        lifted = rate * ahead + integral(rate, ahead)
        gone = integral(integral(pull + along * rate**2 * ahead, sliding) + mu * lifted, sliding)
    path = np.concatenate([np.zeros(first), gone])
    return Slide(time_s=t, tilt_rad=tilt, onset_s=onset_s, onset_rad=onset_rad, path_m=path, along=along)


def integral(values: FLOATS, over: FLOATS) -> FLOATS:
    """The integral up to each point, by trapezia."""
    return np.asarray(cumulative_trapezoid(values, over, initial=0.0), dtype=np.float64)


def exact_slide(curve: slider.LimitCurve, *, rate_deg_s: float, azimuth_rad: float = 0.0) -> Slide:
    """The exact slider on a linear staircase; off the steepest line when the curve is no circle."""
    t, tilt = staircase(rate_deg_s, ramp="linear")
    corner = np.flatnonzero(np.abs(np.diff(tilt, 2)) > 1e-9) + 1
    knots = np.unique(np.concatenate([[0], corner, [len(t) - 1]]))
    profile = slider.Tilt(
        time_s=tuple(t[knots].tolist()), angle_rad=tuple(tilt[knots].tolist()), azimuth_rad=azimuth_rad
    )
    start = slider.onset_angle(curve, profile.slope)
    end = int(np.argmax(tilt > start + np.radians(5 * STEP_DEG)))
    kept = [k for k in knots.tolist() if k < end] + [end]
    profile = replace(profile, time_s=tuple(t[kept].tolist()), angle_rad=tuple(tilt[kept].tolist()))
    found = slider.simulate(profile, curve, output_s=1e-3)
    moved = found.place_m[: int(np.argmax(np.linalg.norm(found.place_m, axis=1) > 6e-3))]
    way = moved[-1] / np.linalg.norm(moved[-1])
    times = found.time_s[: len(moved)]
    return Slide(
        time_s=times,
        tilt_rad=np.interp(times, t, tilt),
        onset_s=found.onset_s,
        onset_rad=found.onset_rad,
        path_m=moved @ way,
        along=float(way @ profile.slope),
    )


def measure(
    truth: Slide,
    *,
    noise_px: float,
    sag_px: float = 0.0,
    scale: float = 1.0,
    rng: np.random.Generator,
    end_s: float | None = None,
    jitter_s: float = 0.0,
    stuck_s: tuple[float, float] = (0.0, 0.0),
) -> Onset | None:
    """Returns the onset that the estimator finds in a slide, seen at 90 Hz with noise and a sagging camera.

    `scale` is what the camera takes for a metre. Its stamps may jitter; encoders may be stuck from a moment on, told
    from the true onset, for so long.
    """
    end = truth.detection_s(sag_px=sag_px) if end_s is None else end_s
    begin = max(truth.time_s[0], end - KEPT_S)
    frames = np.arange(begin + rng.uniform(0, FRAME_S), end, FRAME_S)
    attitudes = np.arange(max(truth.time_s[0], begin - 0.1), min(end + 0.05, truth.time_s[-1]), ATTITUDE_S)
    path = scale * np.interp(frames, truth.time_s, truth.path_m)
    path = path + sag_px / PX_PER_M * np.sin(np.interp(frames, truth.time_s, truth.tilt_rad))
    path = path + noise_px / PX_PER_M * rng.standard_normal(len(frames))
    if jitter_s:
        frames = np.sort(frames + jitter_s * rng.standard_normal(len(frames)))
    read_s = attitudes.copy()
    stuck = (attitudes >= truth.onset_s + stuck_s[0]) & (attitudes < truth.onset_s + sum(stuck_s))
    read_s[stuck] = attitudes[np.argmax(stuck)]
    return estimate_onset(
        np.round(frames * 1e9).astype(np.int64),
        path,
        tilt_ns=np.round(attitudes * 1e9).astype(np.int64),
        tilt_rad=np.interp(read_s, truth.time_s, truth.tilt_rad),
        sigma_m=noise_px / PX_PER_M,
        along=truth.along,
    )
