"""A step of an agent's clock: its offset from the station's has changed by more than round trips leave open."""

from __future__ import annotations

STEP_NS = 2_000_000
"""Clocks of different machines drift by less than this within ten seconds (200 ppm); a larger step is another clock."""


def is_another_clock(before_ns: int, after_ns: int, *, round_trips_ns: int) -> bool:
    """Returns true if two offsets, ns, cannot be of one clock; each may be off by half of its round trip, ns."""
    return abs(after_ns - before_ns) > round_trips_ns // 2 + STEP_NS
