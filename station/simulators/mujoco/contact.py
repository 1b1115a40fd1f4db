"""How MuJoCo holds a block: the settings that keep it until the right angle, and MuJoCo's own for comparison.

MuJoCo's friction is regularised: below the limit the block creeps at (1−d0)/d0 · g sin θ · d1 τ / (2 n impratio), with
d0, d1 = solimp[0:2], τ = solref[0] and n contacts. A pyramidal cone makes false directions. Harder normal contacts
(smaller τ, d0 nearer 1) creep less but chatter when the block breaks loose, which reads 0.1 to 0.25° early; so the
normal direction stays as soft as MuJoCo's default and the tangential one is made hard by impratio.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Contact:
    """MuJoCo's contact settings between block and plate."""

    elliptic: bool
    impratio: float
    solref: tuple[float, float]
    solimp: tuple[float, float, float, float, float]
    tolerance: float


EXACT = Contact(
    elliptic=True, impratio=1000.0, solref=(0.02, 1.0), solimp=(0.9, 0.905, 0.001, 0.5, 2.0), tolerance=1e-14
)
"""The twin's settings, measured by tests/unit/simulators/test_onset.py."""

MUJOCO_DEFAULT = Contact(
    elliptic=False, impratio=1.0, solref=(0.02, 1.0), solimp=(0.9, 0.95, 0.001, 0.5, 2.0), tolerance=1e-8
)
"""MuJoCo's defaults: the block has long crept away when it should start."""
