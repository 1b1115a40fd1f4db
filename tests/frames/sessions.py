"""A session in the twin has a design: pair, runs, scatter, protocol, and the rig file that its user would have."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass

from numpy.random import Generator

from station.sampling.plan import DirectionPlan, DwellPlan, Plan, SlipPlan, TiltPlan
from tests.concealed.design import PAIRS

FEATURES = ("free", "yaw", "replace", "dwell")
"""The factors that a session may vary: the azimuth, the block's yaw, its place, the dwell. `calm` is little scatter."""
RIG_ID = "bench"


@dataclass(frozen=True, kw_only=True)
class Design:
    """A session's protocol. The block is put back by hand every `handled_every` runs, within `placed_m` of the middle.

    Slides from there end on the plate: a block that leans on the foam is pushed by it as the plate tilts.

    `scatter` is the standard deviation of a contact's friction angle over its mean; `noise_px` is that of a corner's
    coordinate where there are no frames (the tracker's, and twice that), and `light` how bright white is where there
    are.
    """

    runs: int
    pair: str
    scatter: float
    free: bool
    handled_every: int
    placed_m: float
    yaw_varies: bool
    dwell_s: tuple[float, float]
    rate_deg_s: float
    noise_px: float
    light: float
    masses: tuple[float, ...] = (1.0,)

    @property
    def mean_mu(self) -> float:
        """The pair's coefficient."""
        return PAIRS[self.pair][2]

    def plan(self, seed: int) -> Plan:
        """For `station run`: a range of angles that holds the pair's scatter, few steps, the return at once."""
        mean_deg = math.degrees(math.atan(self.mean_mu))
        wide_deg = min(mean_deg * (1.45 + 4.0 * self.scatter) + 5.0, 60.0)
        return Plan(
            samples=self.runs,
            seed=seed,
            faults=20,
            tilt=TiltPlan(
                steps=16,
                max_deg=wide_deg,
                adapt_after=6,
                rate_deg_s=self.rate_deg_s,
                return_rate_deg_s=40.0,
                hold_s=0.03,
            ),
            slip=SlipPlan(base_px=6.0, per_deg_px=0.2),
            dwell=DwellPlan(min_s=self.dwell_s[0], max_s=self.dwell_s[1]),
            direction=DirectionPlan(mode="free" if self.free else "four", min_slide_px=150.0),
        )


def draw_design(rng: Generator, *, pair: str, runs: int, needs: Collection[str]) -> Design:
    """A protocol with the features that are needed, and perhaps more of them."""
    features = set(needs) | {name for name in FEATURES if rng.random() < 0.25}
    scatter = float(rng.uniform(0.05, 0.08 if "calm" in features else 0.14))
    return Design(
        runs=runs,
        pair=pair,
        scatter=scatter,
        free="free" in features,
        handled_every=int(rng.integers(1, 3)),
        placed_m=0.014 if "replace" in features else 0.004,
        yaw_varies="yaw" in features,
        dwell_s=(0.3, 40.0) if "dwell" in features else (0.4, 0.4),
        rate_deg_s=12.0 if "dwell" in features else float(rng.choice([5.0, 8.0, 12.0])),
        noise_px=math.exp(float(rng.uniform(math.log(0.03), math.log(0.1)))),
        light=float(rng.uniform(0.6, 1.0)),
    )


def rig_toml(design: Design, *, mu_guess: float) -> str:
    """The rig file: what the user knows of the rig, and a first guess of its friction."""
    block, plate, _, mass_kg = PAIRS[design.pair]
    return f"""# A measuring rig: tilting plate, one camera above it.
id = "{RIG_ID}"

[camera]
driver = "synthetic"
rate_hz = 90.0
width_px = 600
height_px = 600
preview_hz = 0.0

[mark]
side_mm = 7.5
margin = 0.1667
feature = "dot"

[plate]
material = "{plate}"

[block]
name = "{block} cube"
material = "{block}"
size_m = [0.01, 0.01, 0.01]
mass_kg = {mass_kg:.5f}

[arm]
driver = "simulated"
model = "jaco2_spherical"

[twin]
pair = "{block}_on_{plate}"
mean_mu = {mu_guess:.2f}
scatter = 0.10
ratio = 1.0
"""
