"""Border: the soft foam round the plate's opening pushes a block back that runs into it, and turns it.

Foam meets a square block at its corners. At a corner c of a block that stands p deep in the foam, with r from the mass
to the corner and n from P's origin outwards through it, the push per mass is

    F = −(k p + c (v·n)) n / (2 m), never outwards,

so that k and c are those of one side of the block, which has two corners. The origin is right where the opening is
round. Foam's edge is uneven, and the damping sets in over a millimetre. One corner that meets the foam before the
others turns the block: k² ω′ = r × F, k² = A / 6 a square's radius of gyration. Foam that gives way along a whole side
turns it less: `turning` is the share of that moment. Friction holds a block at rest against it. The spring gives the
rebound, the damping the loss.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from shared.vectors import columns
from station.physics.circle import cos_sin
from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter
from station.physics.sole import SQUARE_GYRATION

CORNERS = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))
"""The corners of a square, from its middle, in halves of its side."""
LIPS_M = tuple(1.5e-3 * number for number in range(9))
"""The lips, m, from which a fit begins, over the whole range: one that is 2 mm off explains nothing of a sudden contact
(`python -m tests.proof --tier patch_world/single:36 --no-refits --seed 20261540`, 013 and 034)."""
UNEVEN_M = 1e-3
"""The depth, m, over which the damping sets in: foam's edge is no straighter. At once it would be a step in the lip,
along which a fit has no slope: the lip of 013 stayed where it began."""
LEAST_M = 1e-9
"""The least distance from P's origin by which a way outwards is divided."""


class BorderContact(Effect):
    """The foam border resists."""

    id: ClassVar[str] = "border_contact"
    title: ClassVar[str] = "contact with the border"
    law: ClassVar[str] = (
        "in the foam, which begins a lip before its nominal edge, each corner is pushed inwards by half of k depth + c "
        "speed, and turns the block (k = c = 0)"
    )
    source: ClassVar[str] = (
        "Dressel et al., section III.B and figure 2 (foam border); Kelvin–Voigt contact, Hunt & Crossley 1975"
    )
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "place"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="stiffness_n_m", symbol="k", unit="N/m", low=0.0, high=1000.0, typical=20.0),
        Parameter(name="damping_n_s_m", symbol="c", unit="N s/m", low=0.0, high=5.0, typical=0.1, sizes=(0.3,)),
        Parameter(name="lip_m", unit="m", low=0.0, high=0.012, typical=3e-3, null=None, starts=LIPS_M),
        Parameter(name="turning", unit="1", low=0.0, high=1.0, typical=0.5, null=None, starts=(1.0,)),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("friction_patch",)
    separated_by: ClassVar[str] = "slides that end well inside the opening beside slides that reach the border"

    def push(self, contact: Contact, values: Values) -> Array | None:
        """Gives the force per mass (n, 3), m/s², by the law of this module."""
        force, _ = _met(contact, values)
        return columns(*force, np.zeros(len(contact)))

    def spin(self, contact: Contact, values: Values) -> Array | float:
        """Gives the angular acceleration (n,), rad/s², of sliding blocks by the law of this module."""
        _, moment = _met(contact, values)
        turned = values["turning"] * moment / (SQUARE_GYRATION * contact.area_m2)
        return np.where(contact.moving, turned, 0.0)


def _met(contact: Contact, values: Values) -> tuple[Array, Array]:
    """Returns the foam's force (2, n), m/s², on a block, and its moment about the mass (n,), m²/s²; both per mass."""
    corner = _corners(contact)
    place = corner + np.array([contact.x_m, contact.y_m])[:, None]
    reach = np.maximum(np.hypot(*place), LEAST_M)
    outward, way = place / reach, np.array(cos_sin(contact.way_rad))[:, None]
    leaving = np.where(contact.moving, contact.speed_m_s, 0.0) * (outward * way).sum(axis=0)
    depth = np.maximum(values["lip_m"] - contact.border_m - (reach.max(axis=0) - reach), 0.0)
    met = np.minimum(depth / UNEVEN_M, 1.0)
    size = np.maximum(values["stiffness_n_m"] * depth + values["damping_n_s_m"] * met * leaving, 0.0)
    force = -0.5 * size / contact.mass_kg * outward
    moment = corner[0] * force[1] - corner[1] * force[0]
    return force.sum(axis=1), moment.sum(axis=0)


def _corners(contact: Contact) -> Array:
    """Returns the corners (2, 4, n), m, from the block's middle."""
    half, (cosine, sine) = 0.5 * np.sqrt(contact.area_m2), cos_sin(contact.yaw_rad)
    along, aside = np.array(CORNERS).T[:, :, None] * half
    return np.array([cosine * along - sine * aside, sine * along + cosine * aside])
