"""Tipping: a tall block falls over before it slides.

A block of height q w on a square base of width w stands while the vertical through its centre of mass meets its base,
tan θ q max(|cos β|, |sin β|) < 1, β the descent's direction against the edges: a cube (q = 1) falls at 45° along an
edge and at 54.7° along a diagonal. A flat block (q = 0) never does. This is no friction, so no factor can say it: what
changes is the picture. Beyond that tilt the top, with its mark, turns over the lower edge within 0.02 rad of tilt (some
hundredths of a second), shifts and foreshortens; the block's friction was not measured, only that it is larger. The
mark is taken to be as wide as the block. A block that already slides does not tip.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact, View
from station.physics.effect import Effect, Family, Layer, Values, unit
from station.physics.parameter import Parameter

TALLEST = 5.0
FALL_RAD = 0.02
STILL_M_S = 5e-3


class Tipping(Effect):
    """A tall block turns over its lower edge."""

    id: ClassVar[str] = "tipping"
    title: ClassVar[str] = "tipping"
    law: ClassVar[str] = "a block at rest turns over where tan(tilt) exceeds its width over its height q w (q = 0)"
    source: ClassVar[str] = "ISRM suggested method for tilt tests, Alejano et al. 2018, Rock Mech. Rock Eng. 51, 3799"
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "image"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="slenderness", unit="1", low=0.0, high=TALLEST, typical=1.0),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("presliding",)
    separated_by: ClassVar[str] = "a flat specimen of the same material, which cannot tip"

    def seen(self, view: View, values: Values) -> Array | None:
        """See the module."""
        if not view.on_block or values["slenderness"] == 0.0:
            return None
        lead_rad, lean = _lower_edge(view)
        excess = view.tilt_rad - np.arctan2(1.0, values["slenderness"] * lean)
        still = np.hypot(view.velocity_m_s[:, 0], view.velocity_m_s[:, 1]) < STILL_M_S
        share = np.where(still, np.clip(excess / FALL_RAD, 0.0, 1.0), 0.0)
        turned = (np.pi / 2 * share * share * (3.0 - 2.0 * share))[:, None]
        lead = unit(lead_rad)
        behind = np.einsum("nck,nk->nc", view.point_m - view.centre_m[:, None, :], lead) - view.side_m / 2
        shift = behind * (np.cos(turned) - 1.0) + values["slenderness"] * view.side_m * np.sin(turned)
        return shift[:, :, None] * lead[:, None, :]

    def why_untestable(self, contact: Contact) -> str | None:
        """See the base class."""
        steepest = float(np.max(contact.tilt_rad, initial=0.0))
        if np.tan(min(steepest, 1.5)) * TALLEST > 1.0:
            return None
        return (
            f"No run was tilted beyond {np.degrees(steepest):.1f}°, "
            f"and a block {TALLEST:g} times as high as wide stands up to {np.degrees(np.arctan(1 / TALLEST)):.1f}°."
        )


def _lower_edge(view: View) -> tuple[Array, Array]:
    """Direction in P (n,) of the edge over which the block would fall, and cos of the descent's angle to it (n,)."""
    side = view.point_m[:, 1] - view.point_m[:, 0]
    yaw = np.arctan2(side[:, 1], side[:, 0])
    quarter = np.pi / 2
    lead = yaw + quarter * np.round((view.down_rad - yaw) / quarter)
    return lead, np.cos(view.down_rad - lead)
