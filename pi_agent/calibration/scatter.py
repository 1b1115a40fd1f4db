"""Measures a resting corner's scatter (the paper's "estimated variance"), and an exposure's cost in motion blur."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pi_agent.cameras import CameraInfo, Frame, Image
from pi_agent.observer import Observer
from shared.errors import UserError
from shared.rig import RigConfig

LEAST_FOUND = 0.95
LARGEST_DRIFT = 4.0
"""The mean of the last third less that of the first, in its own standard errors."""
SPEEDS_M_S = (0.1, 0.3)
TOLERATED_BLUR_PX = 2.0


@dataclass(frozen=True)
class Scatter:
    """`sigma_px`: deviation of one coordinate of a corner; `said_px`: what the tracker says of itself."""

    frames: int
    sigma_px: float
    said_px: float


@dataclass(frozen=True)
class ExposureRow:
    """One exposure: the level of the brightest part (0…255), the share of frames with the mark, its scatter."""

    exposure_ms: float
    white: float
    found: float
    sigma_px: float


def measure_scatter(frames: Image, rig: RigConfig, info: CameraInfo) -> Scatter:
    """Returns the scatter of the resting block's corners over frames (n, height, width).

    Raises:
        UserError: if the mark is not found, or does not rest.
    """
    corners, said = _corners(frames, rig, info)
    if len(corners) < LEAST_FOUND * len(frames):
        raise UserError(
            f"Expected the block's mark in every frame, found it in {len(corners)} of {len(frames)}: put the block in "
            "the middle of the plate, and look at `pi-agent track` or the log for the reason"
        )
    third = max(len(corners) // 3, 1)
    deviation = np.maximum(corners.std(axis=0, ddof=1), 1e-6)
    drift = np.abs(corners[-third:].mean(axis=0) - corners[:third].mean(axis=0)) / (deviation * np.sqrt(2 / third))
    # The root mean square over the eight coordinates: one alone passes any bound now and then.
    if float(np.sqrt(np.mean(drift**2))) > LARGEST_DRIFT:
        raise UserError("Expected a block at rest, but its corners drift: let the rig settle, and try again")
    return Scatter(len(corners), float(np.sqrt(np.mean(deviation**2))), said)


def exposure_row(frames: Image, rig: RigConfig, info: CameraInfo) -> ExposureRow:
    """Returns the results of one exposure, from `frames` (n, height, width), 8-bit grey values."""
    corners, _ = _corners(frames, rig, info)
    sigma = float(np.sqrt(np.mean(corners.var(axis=0, ddof=1)))) if len(corners) > 2 else float("nan")
    white = float(np.quantile(frames.mean(axis=0), 0.995))
    return ExposureRow(info.exposure_ns / 1e6, white, len(corners) / len(frames), sigma)


def _corners(frames: Image, rig: RigConfig, info: CameraInfo) -> tuple[np.ndarray, float]:
    """Returns the found corners (m, 8), without the frames in which the tracker still learns; its mean own sigma."""
    observer = Observer(rig, info)
    period_ns = round(1e9 / info.rate_hz)
    seen = [observer.block(Frame(frame, number * period_ns, number)) for number, frame in enumerate(frames)]
    found = [report for report in seen if report.found]
    said = float(np.mean([report.sigma_px for report in found])) if found else float("nan")
    return np.array([report.corners_px for report in found]).reshape(-1, 8), said


def blur_px(exposure_ms: float, *, speed_m_s: float, px_per_mm: float) -> float:
    """Returns the path of a sliding block during the exposure, in pixels."""
    return exposure_ms * speed_m_s * px_per_mm


def exposure_table(rows: list[ExposureRow], *, px_per_mm: float) -> list[str]:
    """Returns the exposures as lines of text: what each costs in blur, what it leaves in light and certainty."""
    head = "  exposure   white   mark found   corner scatter   path in the exposure at " + ", ".join(
        f"{speed} m/s" for speed in SPEEDS_M_S
    )
    lines = [head]
    for row in rows:
        paths = ", ".join(f"{blur_px(row.exposure_ms, speed_m_s=s, px_per_mm=px_per_mm):.1f} px" for s in SPEEDS_M_S)
        light = f"{row.exposure_ms:5.2f} ms   {row.white:5.0f}   {100 * row.found:8.0f} %"
        lines.append(f"  {light}   {row.sigma_px:11.3f} px   {paths}")
    return lines


def advice(rows: list[ExposureRow], *, px_per_mm: float) -> str:
    """Returns the exposure to take: the longest that keeps the blur of a slide small, among those that work."""
    working = [row for row in rows if row.found >= LEAST_FOUND]
    sharp = [
        row
        for row in working
        if blur_px(row.exposure_ms, speed_m_s=SPEEDS_M_S[0], px_per_mm=px_per_mm) <= TOLERATED_BLUR_PX
    ]
    if not working:
        return "At none of these exposures is the mark found: more light is needed"
    best = max(sharp or working, key=lambda row: row.exposure_ms if sharp else -row.exposure_ms)
    light = " and more light would allow a shorter one" if not sharp else ""
    return (
        f"Advice: exposure_ms = {best.exposure_ms:.2f} (at {SPEEDS_M_S[0]} m/s the mark moves "
        f"{blur_px(best.exposure_ms, speed_m_s=SPEEDS_M_S[0], px_per_mm=px_per_mm):.1f} px within it){light}"
    )
