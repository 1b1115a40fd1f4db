"""Misspecification: no law is exact, and with enough runs the difference stands out.

A likelihood that takes laws for exact becomes ever surer of the least wrong one (Miller & Dunson 2019, JASA 114, 1113:
coarsened posteriors). Chance makes a gain of about 1 in twice the log likelihood; a law that gains G leaves one of
about G / KNOWN_TO to others.
"""

from __future__ import annotations

from collections.abc import Iterable

from station.diagnosis import thresholds


def temperature(gains: Iterable[float]) -> float:
    """Gives the divisor of differences in twice the log likelihood between candidates with such gains for one place."""
    return 1.0 + max(gains, default=0.0) / thresholds.KNOWN_TO
