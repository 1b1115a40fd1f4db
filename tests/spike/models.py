"""The parameters with their priors, and the models: which parameters each effect frees."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tests.spike import forward as f


@dataclass(frozen=True)
class Prior:
    """A normal prior."""

    mean: float
    sd: float


ALWAYS = {
    f.MU: Prior(math.log(0.35), 1.0),
    f.SU: Prior(math.log(0.1), 1.0),
    f.SIG: Prior(0.0, 0.5),
    f.FIDSIG: Prior(0.0, 1.0),
    f.NU: Prior(math.log(20.0), 1.0),
    f.SW: Prior(math.log(0.01), 1.5),
    f.LW: Prior(math.log(3e-3), 0.7),
    f.SHAKE: Prior(math.log(1e-4), 1.0),
    f.TAU: Prior(0.0, 3e-4),
    f.PIVOT: Prior(0.0, 1e-3),
    f.EX: Prior(0.0, 2e-4),
    f.EY: Prior(0.0, 2e-4),
    f.DROP: Prior(0.0, 2e-3),
    f.SAG: Prior(0.0, 2e-6),
}
"""Always in the model: friction, its scatter and wander, noise, and the rig's honest doubts about itself: the clock to
.3 ms, the pivot to 1 mm, the level to .2 mrad, the kinetic drop to .002, the camera's sag to 2 µm."""

EFFECTS: dict[str, tuple[dict[int, Prior], ...]] = {
    "kinetic_drop": ({f.DROP: Prior(0.0, 0.05)},),
    "stribeck": ({f.SF: Prior(0.0, 0.1), f.SV: Prior(math.log(0.02), 1.0), f.SN: Prior(1.3, 0.4)},),
    "rate_strengthening": ({f.RATE: Prior(0.0, 0.02), f.DECADES: Prior(1.5, 0.5)},),
    "viscous": ({f.DRAG: Prior(0.0, 4.0)},),
    "contact_aging": ({f.AGE: Prior(0.0, 0.05), f.AGE0: Prior(0.0, 0.4)},),
    "wear": ({f.WEAR: Prior(0.0, 0.2), f.WEARN: Prior(math.log(50.0), 1.0)},),
    "object_anisotropy": ({f.OX: Prior(0.0, 0.1), f.OY: Prior(0.0, 0.1)},),
    "plate_anisotropy": ({f.PX: Prior(0.0, 0.1), f.PY: Prior(0.0, 0.1)},),
    "one_way_friction": (
        {f.NX: Prior(0.0, 0.1), f.NY: Prior(0.0, 0.1)},
        {f.BX: Prior(0.0, 0.1), f.BY: Prior(0.0, 0.1)},
    ),
    "friction_patch": (
        {f.PATCH + i: Prior(0.0, 0.1) for i in range(8)} | {f.PATCHL: Prior(math.log(0.014), 0.5)},
    ),
    "platform_level": ({f.EX: Prior(0.0, 0.01), f.EY: Prior(0.0, 0.01)},),
    "clock_offset": ({f.TAU: Prior(0.0, 0.02)},),
    "camera_sag": ({f.SAG: Prior(0.0, 1e-3)},),
}  # fmt: skip
"""For each effect its variants: what it frees, or for what the rig doubts anyhow, how far."""

SIGNED = {"kinetic_drop": f.DROP, "stribeck": f.SF, "viscous": f.DRAG, "contact_aging": f.AGE}
"""Effects that only one sign of a parameter allows."""

STARTS = {
    f.SV: (math.log(0.02), math.log(0.06)),
    f.SN: (1.3,),
    f.DECADES: (1.5,),
    f.AGE0: (0.0,),
    f.WEARN: (math.log(20.0), math.log(100.0)),
    f.PATCHL: (math.log(0.014), math.log(0.009)),
}


@dataclass(frozen=True)
class Model:
    """Effects, each with one of its variants."""

    names: tuple[tuple[str, int], ...]

    @property
    def effects(self) -> tuple[str, ...]:
        """The effects' names."""
        return tuple(name for name, _ in self.names)

    @property
    def priors(self) -> dict[int, Prior]:
        """All that is free, with its prior."""
        free = dict(ALWAYS)
        for name, variant in self.names:
            free |= EFFECTS[name][variant]
        return free


NULL = Model(())
START = np.zeros(f.COUNT)
for _place, _prior in ALWAYS.items():
    START[_place] = _prior.mean
for _place, _values in STARTS.items():
    START[_place] = _values[0]
START[f.SW] = math.log(0.003)
