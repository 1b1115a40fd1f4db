"""The settings with which MuJoCo holds and slides a block rightly, and MuJoCo's own for comparison.

MuJoCo's contact is a regularised convex problem, and three of its traits matter here.

- Below the limit the block creeps at (1−d0)/d0 · g sin θ · d1 τ / (2 n impratio), with d0, d1 = solimp[0:2], τ the
  friction's time constant and n contacts: a large `impratio` makes that nothing. A pyramidal cone makes false ways.
- A sliding contact is pushed apart: its normal constraint gives way by mu b v, with b = 2/(d1 τ) the friction's
  damping and v the speed, against a reserve of (1−d)/d · g. When it is used up the block hops, reads its onset early,
  leaves its way by degrees and slides twice too far (with d = 0.9 and τ = 0.02 s from 20 mm/s on). A small impedance d
  gives a large reserve, at the price of feet that sink in by 0.2 mm (see `poses.standing`).
- The friction's damping also says how a block stops: below v = (mu g − pull)/b it comes to rest exponentially, so
  τ must not be large.

tests/unit/simulators/test_onset.py and test_slide.py measure all of this.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Contact:
    """MuJoCo's contact settings between block and plate."""

    elliptic: bool
    impratio: float
    solref: tuple[float, float]
    solref_friction: tuple[float, float]
    solimp: tuple[float, float, float, float, float]
    tolerance: float


EXACT = Contact(
    elliptic=True,
    impratio=5e4,
    solref=(0.007, 1.0),
    solref_friction=(0.1, 1.0),
    solimp=(0.15, 0.151, 0.001, 0.5, 2.0),
    tolerance=1e-11,
)
"""The twin's settings."""

MUJOCO_DEFAULT = Contact(
    elliptic=False,
    impratio=1.0,
    solref=(0.02, 1.0),
    solref_friction=(0.0, 0.0),
    solimp=(0.9, 0.95, 0.001, 0.5, 2.0),
    tolerance=1e-8,
)
"""MuJoCo's defaults, with which the block has long crept away when it should start."""
