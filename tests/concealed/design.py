"""The design of a session: the machine's plan, what varies from run to run, and what disturbs it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from tests.concealed.world import NULL, World

PAIRS = {
    "steel on steel": ("steel", "steel", 0.365, 0.00785),
    "steel on wood": ("steel", "wood", 0.21, 0.00785),
    "wood on steel": ("wood", "steel", 0.22, 0.00070),
    "wood on wood": ("wood", "wood", 0.46, 0.00070),
}
"""The paper's four pairs: the block's and the plate's material, friction coefficient, mass of a 10 mm cube (kg)."""


@dataclass(frozen=True, kw_only=True)
class Nuisance:
    """The nuisances that disturb every measurement without being an effect.

    `scatter` is the standard deviation of a run's friction over the mean; with `tail` (Student's degrees of freedom) it
    has heavy tails. `noise_px` is one corner's standard deviation, growing by `noise_drift` from the first run to the
    last. `knocks` and `dropouts` are probabilities, of a run and of a frame.
    """

    scatter: float = 0.1
    tail: float = math.inf
    noise_px: float = 0.2
    noise_drift: float = 0.0
    knocks: float = 0.0
    dropouts: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Design:
    """A session's protocol. Angles in radians, except where a name says degrees, because plans are written in them.

    `wide_steps` up to `wide_deg` are tried until `adapt_after` slips of a direction are there, then `steps` within
    three standard deviations of their mean. The block is put back by hand every `handled_every` runs (0: never), with a
    new
    yaw if `yaw_varies`. `masses` and `mounts_deg` change in blocks of runs, so that nobody has to touch the rig for
    every run; rates and dwells are drawn for each run.
    """

    runs: int = 200
    directions: tuple[int, ...] = (0, 1, 2, 3)
    free: bool = False
    wide_steps: int = 24
    wide_deg: float = 48.0
    steps: int = 50
    adapt_after: int = 8
    rates_deg_s: tuple[float, ...] = (8.0,)
    return_deg_s: float = 60.0
    acceleration_deg_s2: float = 200.0
    hold_s: float = 0.05
    dwell_s: tuple[float, float] = (0.4, 0.4)
    dwell_falls: bool = False
    """The dwell goes from its longest to its shortest in the order of the runs, instead of at random."""
    handled_every: int = 0
    yaw_varies: bool = False
    masses: tuple[float, ...] = (1.0,)
    mounts_deg: tuple[float, ...] = (0.0,)
    second_sensor: bool = False
    sensor_noise_deg: float = 0.1
    shuttle: bool = False
    """Always where there is most room: start place and previous direction coincide."""
    base_px: float = 10.0
    per_deg_px: float = 1.0
    pair: str = "steel on steel"
    min_slide_px: float = 150.0


@dataclass(frozen=True, kw_only=True)
class Setting:
    """Everything that makes one session but its random numbers."""

    design: Design = field(default_factory=Design)
    nuisance: Nuisance = field(default_factory=Nuisance)
    world: World = NULL
