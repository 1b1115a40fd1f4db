"""Phases of a run, with a message stream of one's own."""

from __future__ import annotations

import math

from shared.messages import ClockOffset, MarkerCorners
from station.sampling.actions import Action, Finish, Report, Say
from station.sampling.clocks import AGENTS
from station.sampling.phases import Phases
from station.sampling.plan import Plan
from station.sampling.run import Specimen
from tests.unit.sampling.scripted_rig import GEOMETRY

SECOND_NS = 1_000_000_000
SQUARE_PX = (270.0, 330.0, 330.0, 330.0, 330.0, 270.0, 270.0, 270.0)


def phases(plan: Plan, *, phase: str = "START", now_ns: int = 100 * SECOND_NS) -> Phases:
    """Returns phases that have stood in `phase` since now, with nothing heard but that all clocks are alike."""
    found = Phases(plan, size_px=(600, 600), reach=lambda _: math.radians(60.0), specimen=Specimen(), geometry=GEOMETRY)
    found.state.begin(now_ns)
    found.state.enter_silently(phase)
    know_clocks(found, now_ns=now_ns)
    return found


def know_clocks(found: Phases, *, now_ns: int) -> None:
    """Tells the phases that all clocks are alike now."""
    for agent in AGENTS:
        found.tracks.clocks.take(ClockOffset(agent=agent), now_ns=now_ns)


def corners(capture_ns: int, **changed: object) -> MarkerCorners:
    """Returns a frame that shows the mark."""
    values: dict[str, object] = {"capture_ns": capture_ns, "corners_px": SQUARE_PX, "found": True, "boot_id": 1}
    return MarkerCorners(**(values | changed))  # pyright: ignore[reportArgumentType]


def told(actions: list[Action]) -> list[str]:
    """Returns the phases that were reported, the logged lines' levels, and the session's end."""
    names = list[str]()
    for action in actions:
        if isinstance(action, Report):
            names.append(getattr(action.message, "phase", type(action.message).__name__))
        elif isinstance(action, Say):
            names.append(action.level)
        elif isinstance(action, Finish):
            names.append(f"finish: {action.fault}")
    return names
