"""Sessions as other people would plan them, with other blocks and plates: what both generators hold to one design."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from station.sampling.plan import DirectionPlan, DwellPlan, Plan, SlipPlan, TiltPlan
from tests.proof.patch_world.world import Contact, World

RUNS = 120

PAPER = {"tilt": TiltPlan(), "dwell": DwellPlan(), "direction": DirectionPlan()}
"""The plan of the paper, which is the default."""


@dataclass(frozen=True, kw_only=True)
class Design:
    """Changes of the generator's plan, by its parts, and of its block and plate, by their names; `runs` of it."""

    runs: int = RUNS
    plan: Mapping[str, Any] = field(default_factory=dict[str, Any])
    tilt: Mapping[str, Any] = field(default_factory=dict[str, Any])
    contact: Mapping[str, float] = field(default_factory=dict[str, float])

    def planned(self, plan: Plan) -> Plan:
        """Returns the plan, changed."""
        changed = replace(plan, **self.plan)
        return replace(changed, tilt=replace(changed.tilt, **self.tilt))

    def built(self, world: World) -> World:
        """Returns the world with the other block and plate; a block of another size has the same density."""
        old, new = world.contact, world.contact._replace(**self.contact)
        return replace(world, contact=new._replace(mass=old.mass * _volume(new) / _volume(old)))


def _volume(block: Contact) -> float:
    return block.half_x * block.half_y * block.height


def _block(half_m: float, height_m: float, *, aspect: float = 1.0) -> dict[str, float]:
    return {"half_x": half_m, "half_y": aspect * half_m, "height": height_m, "pivot_height": 0.5 * height_m}


DESIGNS: Mapping[str, Design] = {
    "as it is": Design(),
    "the paper's plan": Design(plan=PAPER),
    "four directions": Design(plan={"direction": DirectionPlan()}),
    "to and fro along one axis": Design(plan={"direction": DirectionPlan(some=(0, 2))}),
    "one rate": Design(tilt={"rates_deg_s": (8.0,)}),
    "one rest": Design(plan={"dwell": DwellPlan(min_s=1.0, max_s=1.0)}),
    "one motion at 1°/s": Design(runs=60, tilt={"steps": 1, "rates_deg_s": (1.0,)}),
    "one motion at 5°/s": Design(tilt={"steps": 1, "rates_deg_s": (5.0,)}),
    "one motion at 30°/s": Design(tilt={"steps": 1, "rates_deg_s": (30.0,)}),
    "ten steps": Design(tilt={"steps": 10, "max_deg": 50.0}),
    "slips told at 2 px": Design(plan={"slip": SlipPlan(base_px=2.0, per_deg_px=0.0)}),
    "25 runs": Design(runs=25),
    "friction of .08": Design(tilt={"steps": 48, "max_deg": 24.0}, contact={"mu": 0.08}),
    "friction of .15": Design(tilt={"steps": 48, "max_deg": 24.0}, contact={"mu": 0.15}),
    "friction of .8": Design(tilt={"steps": 30, "max_deg": 60.0}, contact={"mu": 0.8}),
    "a block of 8 mm": Design(contact=_block(0.004, 0.004)),
    "a block of 32 mm": Design(contact=_block(0.016, 0.02)),
    "an oblong block": Design(contact=_block(0.012, 0.007, aspect=0.5)),
    "a block as tall as wide": Design(contact=_block(0.008, 0.016)),
    "an opening of 44 mm": Design(contact={"wall_radius": 0.022}),
    "a wrist that rings at 5 Hz": Design(contact={"ring_hz": 5.0, "ring_damping": 0.15}),
}
