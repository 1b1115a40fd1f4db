"""The paper's slip rule: three of four corners farther from their reference than l = 10 + θ pixels (section III.C)."""

from __future__ import annotations

import math

from station.sampling.plan import SlipPlan


def threshold_px(plan: SlipPlan, *, tilt_rad: float) -> float:
    """Returns the threshold l in pixels; θ, in degrees, allows for a camera that sags as it is tilted."""
    return plan.base_px + plan.per_deg_px * math.degrees(tilt_rad)


def displacements_px(corners_px: tuple[float, ...], reference_px: tuple[float, ...]) -> tuple[float, ...]:
    """Returns the distance of each corner from its reference, in pixels."""
    steps = [seen - before for seen, before in zip(corners_px, reference_px, strict=True)]
    return tuple(math.hypot(x, y) for x, y in zip(steps[0::2], steps[1::2], strict=True))


def within(corners_px: tuple[float, ...], reference_px: tuple[float, ...], *, limit_px: float) -> bool:
    """Returns true if every corner is surely within `limit_px` of its reference.

    It is a quick test for a block that lies still.
    """
    # No corner is farther away than all of them together; a thousandth is room for rounding.
    return math.dist(corners_px, reference_px) < 0.999 * limit_px


def slipped(plan: SlipPlan, *, corners_px: tuple[float, ...], reference_px: tuple[float, ...], tilt_rad: float) -> bool:
    """Returns true if the rule reports a slip for this frame."""
    limit = threshold_px(plan, tilt_rad=tilt_rad)
    if within(corners_px, reference_px, limit_px=limit):
        return False
    return sum(moved > limit for moved in displacements_px(corners_px, reference_px)) >= plan.corners


class RestDetector:
    """Detects when the block has come to rest: no corner has moved `rest_px` within `rest_s`."""

    def __init__(self, plan: SlipPlan) -> None:
        self._plan = plan
        self._anchor: tuple[float, ...] | None = None
        self._anchor_ns = 0

    def add(self, corners_px: tuple[float, ...], *, capture_ns: int) -> int | None:
        """Takes a frame; returns the time since which the block is at rest, or None while it moves."""
        if self._anchor is None or not (
            within(corners_px, self._anchor, limit_px=self._plan.rest_px)
            or max(displacements_px(corners_px, self._anchor)) <= self._plan.rest_px
        ):
            self._anchor, self._anchor_ns = corners_px, capture_ns
            return None
        return self._anchor_ns if capture_ns - self._anchor_ns >= self._plan.rest_s * 1e9 else None
