"""Toppling: where a block on a slope turns over its lower edge, and what the picture of its top then does.

A block of width w whose centre of mass is at the height q w / 2, d off the middle of its sole, stands while the
vertical through that centre meets the sole. With n the outward normal of an edge and β the angle from n to the descent,
the moments about the edge balance at

    tan θ q cos β = 1 − 2 (d · n) / w

(d = 0: ISRM suggested method for tilt tests, Alejano et al. 2018, Rock Mech. Rock Eng. 51, 3799). It falls over the
edge for which that is the smallest tilt, within `FALL_RAD` of tilt beyond it (some hundredths of a second). A block
that already slides does not fall. The mark is taken to be as wide as the block.
"""

from __future__ import annotations

import numpy as np

from station.physics.contact import Array, View, unit

FALL_RAD = 0.02
STILL_M_S = 5e-3
LEAST_MARGIN = 1e-6
"""A mass beyond the edge topples the block at once."""


def toppling_load(lean: Array, mass: Array) -> Array:
    """Returns the share (m, n) of what a block stands that `lean` (n, 4) makes of it with its mass at `mass` (m, 3).

    A lean is tan θ cos β towards each edge's normal, at quarter turns from the block's x, at least 0; a place is from
    the sole's middle, in the block's frame, in widths of the sole. From 1 on it topples; without a height it never
    does.
    """
    turns = np.pi / 2 * np.arange(4.0)
    margin = 1.0 - 2.0 * (mass[:, :1] * np.cos(turns) + mass[:, 1:2] * np.sin(turns))
    share = 2.0 * mass[:, 2:] / np.maximum(margin, LEAST_MARGIN)
    load = np.zeros((len(mass), len(lean)))
    for one, of in zip(lean.T, share.T, strict=True):
        np.maximum(load, of[:, None] * one, out=load)
    return load


def fallen(view: View, *, slenderness: float, offset_m: tuple[float, float] = (0.0, 0.0)) -> Array:
    """Gives the displacement (n, 4, 2), m, in P, of the mark's corners by the fall of a block q times as high as wide.

    `offset_m` is the place of its mass from the middle of its sole, in the block's frame.
    """
    lead_rad, stands_rad = lower_edge(view, slenderness=slenderness, offset_m=offset_m)
    still = np.hypot(view.velocity_m_s[:, 0], view.velocity_m_s[:, 1]) < STILL_M_S
    share = np.where(still, np.clip((view.tilt_rad - stands_rad) / FALL_RAD, 0.0, 1.0), 0.0)
    turned = (np.pi / 2 * share * share * (3.0 - 2.0 * share))[:, None]
    lead = unit(lead_rad)
    behind = np.einsum("nck,nk->nc", view.point_m - view.centre_m[:, None, :], lead) - view.side_m / 2
    shift = behind * (np.cos(turned) - 1.0) + slenderness * view.side_m * np.sin(turned)
    return shift[:, :, None] * lead[:, None, :]


def lower_edge(view: View, *, slenderness: float, offset_m: tuple[float, float]) -> tuple[Array, Array]:
    """Returns the direction in P (n,), rad, of the edge over which the block falls first, and at which tilt (n,)."""
    side = view.point_m[:, 1] - view.point_m[:, 0]
    turns = np.pi / 2 * np.arange(4.0)
    normals = np.arctan2(side[:, 1], side[:, 0])[:, None] + turns
    margin = 1.0 - 2.0 / view.side_m * (np.cos(turns) * offset_m[0] + np.sin(turns) * offset_m[1])
    leans = np.cos(view.down_rad[:, None] - normals)
    stands = np.where(leans > 0.0, np.arctan2(margin, slenderness * np.maximum(leans, 0.0)), np.pi)
    first = np.argmin(stands, axis=1)[:, None]
    return np.take_along_axis(normals, first, 1)[:, 0], np.take_along_axis(stands, first, 1)[:, 0]
