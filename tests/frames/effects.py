"""The twin conceals effects: for each its draw, its parameters in the key's words, and what it changes.

Identifiers and parameters are those of tests/concealed, so that one scorer reads both keys.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from numpy.random import Generator

from station.simulators.mujoco.influence import Influence
from station.simulators.mujoco.specimen import FixedIn
from tests.frames.mechanisms import Ageing, Drag, KineticDrop, Patch, Wear

Parameters = dict[str, float]


@dataclass(frozen=True, kw_only=True)
class Changes:
    """The differences from the plain twin. `ellipse` is ln of mu along its axis over mu across it.

    `level` is gravity's part along the plate (x, y) where the arm believes it level; the camera's stamps are `late`
    by so many frames, and its picture moves uphill by `sag_px` where the plate stands upright.
    """

    influence: Influence | None = None
    ellipse: float = 0.0
    axis_rad: float = 0.0
    fixed_in: FixedIn = "object"
    level: tuple[float, float] = (0.0, 0.0)
    late: int = 0
    sag_px: float = 0.0


NOTHING = Changes()


@dataclass(frozen=True, kw_only=True)
class Effect:
    """One effect: how it is drawn, and what a drawn one changes; `value` is the parameter that is its strength.

    `needs` are features of a session without which nobody could see it (`sessions.py`).
    """

    id: str
    unit: str
    value: str
    draw: Callable[[Generator], Parameters]
    changes: Callable[[Parameters], Changes]
    needs: tuple[str, ...] = ()


def _uniform(**ranges: tuple[float, float]) -> Callable[[Generator], Parameters]:
    return lambda rng: {name: float(rng.uniform(*bounds)) for name, bounds in ranges.items()}


def _ellipse(where: FixedIn) -> Effect:
    grain, axis = f"grain_{where}", f"grain_{where}_axis"
    return Effect(
        id=f"{where}_anisotropy", unit="ln of the ellipse's ratio", value=grain, needs=("free", "yaw"),
        draw=lambda rng: {
            grain: float(rng.uniform(0.25, 0.45)), axis: float(rng.uniform(0.0, math.pi)), f"{grain}_shape": 0.0,
        },
        changes=lambda told: Changes(ellipse=told[grain], axis_rad=told[axis], fixed_in=where),
    )  # fmt: skip


def _patch(rng: Generator) -> Parameters:
    turn, reach = float(rng.uniform(0.0, 2.0 * math.pi)), float(rng.uniform(0.004, 0.012))
    sign = -1.0 if rng.random() < 0.5 else 1.0
    return {
        "patch": sign * float(rng.uniform(0.3, 0.45)), "patch_radius": float(rng.uniform(0.009, 0.013)),
        "patch_x": reach * math.cos(turn), "patch_y": reach * math.sin(turn), "patch_shape": 0.0,
    }  # fmt: skip


def _level(rng: Generator) -> Parameters:
    lean, turn = math.radians(float(rng.uniform(1.2, 2.2))), float(rng.uniform(0.0, 2.0 * math.pi))
    return {"level_x": lean * math.cos(turn), "level_y": lean * math.sin(turn)}


FRAME_S = 1.0 / 90.0
EFFECTS = {
    effect.id: effect
    for effect in (
        Effect(
            id="kinetic_drop", unit="share of mu_s", value="drop", draw=_uniform(drop=(0.1, 0.25)),
            changes=lambda told: Changes(influence=KineticDrop(told["drop"])),
        ),
        Effect(
            id="platform_level", unit="rad", value="level_x", draw=_level, needs=("yaw", "free"),
            changes=lambda told: Changes(level=(told["level_x"], told["level_y"])),
        ),
        Effect(
            id="wear", unit="share of mu", value="wear", needs=("calm",),
            draw=lambda rng: {
                "wear": float(rng.uniform(0.25, 0.4)), "wear_runs": float(rng.uniform(10.0, 20.0)), "wear_shape": 0.0,
            },
            changes=lambda told: Changes(influence=Wear(told["wear"], told["wear_runs"])),
        ),
        Effect(
            id="camera_sag", unit="px", value="sag_px", draw=_uniform(sag_px=(4.0, 12.0)),
            changes=lambda told: Changes(sag_px=told["sag_px"]),
        ),
        _ellipse("object"),
        Effect(
            id="viscous", unit="1/s", value="drag_per_s", draw=_uniform(drag_per_s=(3.0, 8.0)),
            changes=lambda told: Changes(influence=Drag(told["drag_per_s"])),
        ),
        Effect(
            id="contact_aging", unit="share of mu_s per decade", value="ageing", needs=("calm", "dwell"),
            draw=lambda rng: {
                "ageing": float(rng.uniform(0.12, 0.2)), "ageing_cutoff_s": float(rng.uniform(0.02, 0.2)),
                "ageing_shape": 0.0,
            },
            changes=lambda told: Changes(influence=Ageing(told["ageing"], told["ageing_cutoff_s"])),
        ),
        Effect(
            id="friction_patch", unit="share of mu", value="patch", draw=_patch, needs=("replace",),
            changes=lambda told: Changes(
                influence=Patch(told["patch"], told["patch_x"], told["patch_y"], told["patch_radius"])
            ),
        ),
        Effect(
            id="clock_offset", unit="s", value="late_s", needs=("calm",),
            draw=lambda rng: {"late_s": FRAME_S * int(rng.integers(3, 6))},
            changes=lambda told: Changes(late=round(told["late_s"] / FRAME_S)),
        ),
        _ellipse("plate"),
    )
}  # fmt: skip
"""The effects in the order of their turns: neighbours are of different kinds."""
