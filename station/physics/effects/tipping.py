"""Tipping: a tall block falls over before it slides.

A cube (slenderness q = 1) falls at 45° along an edge and at 54.7° along a diagonal, see `topple`; a flat block (q = 0)
never does. This is no friction, so no factor can say it: what changes is the picture. The top, with its mark, turns
over the lower edge, shifts and foreshortens; the block's friction was not measured, only that it is larger.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact, View
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter
from station.physics.topple import fallen

TALLEST = 5.0


class Tipping(Effect):
    """A tall block turns over its lower edge."""

    id: ClassVar[str] = "tipping"
    title: ClassVar[str] = "tipping"
    law: ClassVar[str] = (
        "a block at rest turns over where tan(tilt) exceeds its width over its height; height = q width (q = 0)"
    )
    source: ClassVar[str] = "ISRM suggested method for tilt tests, Alejano et al. 2018, Rock Mech. Rock Eng. 51, 3799"
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "image"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="slenderness", symbol="q", unit="1", low=0.0, high=TALLEST, typical=1.0),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("presliding",)
    separated_by: ClassVar[str] = "a flat specimen of the same material, which cannot tip"

    def seen(self, view: View, values: Values) -> Array | None:
        """Gives the displacement (n, 4, 2), m, of the corners' images by the law of this module."""
        if not view.on_block or values["slenderness"] == 0.0:
            return None
        return fallen(view, slenderness=values["slenderness"])

    def mass(self, contact: Contact, values: Values) -> Array | None:
        """Returns the centre of mass (n, 3) in the block's frame: half the block's height above the sole."""
        return np.array([0.0, 0.0, values["slenderness"] / 2.0]) * np.ones((len(contact), 1))

    def why_untestable(self, contact: Contact) -> str | None:
        """Runs that were not tilted so far that a tall block topples cannot show it."""
        steepest = float(np.max(contact.tilt_rad, initial=0.0))
        if np.tan(min(steepest, 1.5)) * TALLEST > 1.0:
            return None
        return (
            f"No run was tilted beyond {np.degrees(steepest):.1f}°, "
            f"and a block {TALLEST:g} times as high as wide stands up to {np.degrees(np.arctan(1 / TALLEST)):.1f}°."
        )
