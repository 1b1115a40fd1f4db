"""A square sole of the width L that slides and turns: what resists the turning, and the block's inertia against it.

A point of the sole at r from its middle moves at v e + ω ẑ × r. While ω r is below v its friction leans by ω (r·e) / v
off the way, so that friction h N against sliding alone meets the turning with the moment

    h N (ω / v) ⟨(r·e)²⟩ = h N ω L² / (12 v),

in every direction, as ⟨r rᵀ⟩ = 1 L² / 12 for a square. An ellipsoidal limit surface (Howe & Cutkosky 1996, IJRR 15,
557) has the same moment there with ρ = L / √12. With the often used mean distance of the points, 0.3826 L, it would be
right for a block that spins in its place, and 1.76 times too stiff for one that turns while it slides.

Under a tall block the pressure leads the mass, by a way λ L, and grows linearly toward the front: 1 + 12 λ (r·e) / L of
the mean. What leads is carried aside by the turning, and friction pulls it back: across the way by

    h N (ω / v) ⟨(r·e) (1 + 12 λ (r·e) / L)⟩ = h N λ L ω / v

at the front, whose moment is taken by the pressure, so that ⟨(r·e)²⟩ about its middle is left: L² (1 / 12 − λ²).
Friction that acts beside the mass for another reason, by a · e ahead of it, is carried aside alike, by λ L + a · e.
That is left out: a block whose arm is a fifth of its width swings, and its windows do not follow what changes within
them (with it `station demo --seed 104`, an arm of 1.81 mm, has three further names).
"""

from __future__ import annotations

import math

import numpy as np

from station.physics.contact import Array

TURNING_RADIUS = 1.0 / math.sqrt(12.0)
"""The turning radius ρ of a sole of unit width."""

LIFTS = 1.0 / 6.0
LEAST_M_S = 1e-3
"""The least speed by which a turning is divided."""

SQUARE_GYRATION = 1.0 / 6.0
"""The square radius of gyration of a block of unit width about its upright axis."""


def left_beside_moment(across_m: Array, square_m2: Array | float, area_m2: Array) -> Array:
    """Returns the share (n,) of friction that holds a block at rest on which it acts beside the mass.

    The moment takes the rest of the limit surface |F|² + M² / (ρ² + a²) = (mu N)², with a the arm.

    Args:
        across_m: (n,) the arm's part across the way, m.
        square_m2: (n,) the arm's square, m².
        area_m2: (n,) the sole's area, m².
    """
    return np.sqrt(1.0 - across_m**2 / (TURNING_RADIUS**2 * area_m2 + square_m2))


def left_against_turning(lead: Array) -> Array:
    """Returns the share (n,) of the moment against the turning that a lead (n,), widths of the sole, leaves.

    From a sixth of the width on the sole lifts behind, and stands on 3 (1 / 2 − λ) of it.
    """
    return np.where(lead < LIFTS, 1.0 - 12.0 * lead**2, 6.0 * (0.5 - lead) ** 2)


def carried_across(lead: Array, side_m: Array, *, yaw_rate_rad_s: Array | float, speed_m_s: Array) -> Array:
    """Returns the force (n,) across the way, to the right for a left turn, over the friction against sliding alone.

    Args:
        lead: (n,) the pressure's lead, widths of the sole.
        side_m: (n,) the sole's width, m.
        yaw_rate_rad_s: (n,) the block's turning rate, or one for all, rad/s.
        speed_m_s: (n,) the block's speed, m/s.
    """
    together = np.maximum(np.hypot(speed_m_s, TURNING_RADIUS * side_m * yaw_rate_rad_s), LEAST_M_S)
    return lead * side_m * yaw_rate_rad_s / together
