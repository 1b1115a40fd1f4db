"""A square sole of the width L that slides and turns: what resists the turning, and the block's inertia against it.

A point of the sole at r from its middle moves at v e + ω ẑ × r. While ω r is below v its friction leans by ω (r·e) / v
off the way, so that friction h N against sliding alone meets the turning with the moment

    h N (ω / v) ⟨(r·e)²⟩ = h N ω L² / (12 v),

in every direction, as ⟨r rᵀ⟩ = 1 L² / 12 for a square. An ellipsoidal limit surface (Howe & Cutkosky 1996, IJRR 15,
557) has the same moment there with ρ = L / √12. With the often used mean distance of the points, 0.3826 L, it would be
right for a block that spins in its place, and 1.76 times too stiff for one that turns while it slides.
"""

from __future__ import annotations

import math

TURNING_RADIUS = 1.0 / math.sqrt(12.0)
"""The turning radius ρ of a sole of unit width."""

SQUARE_GYRATION = 1.0 / 6.0
"""The square radius of gyration of a block of unit width about its upright axis."""
