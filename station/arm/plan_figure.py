"""The figure of an arm's plan: its reach at each azimuth, its margins there, and the arm seen from the side."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from station.arm.planning import Pose, Reach
from station.arm.tilt_path import TiltStage, tilt_path
from station.rig.arm_model import Capsule, link_transforms

Array = NDArray[np.float64]
_WANTED_DEG = 67.5
_COLOURS = {"reached": "#1b7f4b", "joint": "#c9731d", "touching": "#b3261e", "reach": "#5b4b9a"}
_MEANINGS = {
    "reached": "67.5° reached",
    "joint": "ended by a joint limit",
    "touching": "ended by a collision",
    "reach": "stretched out or singular",
}


def draw_plan(here: Pose, others: Sequence[Pose], path: Path) -> None:
    """Writes the picture; `others` are poses found by a search, best first (the first is drawn beside `here`)."""
    figure: Any = Figure(figsize=(13, 5.2), layout="constrained", facecolor="white")
    figure.suptitle(f"{here.stage.model.name}: how far the plate tilts with its pivot at rest")
    _draw_reach(figure.add_subplot(1, 3, 1, projection="polar"), here, others)
    _draw_side(figure.add_subplot(1, 3, 2), here)
    _draw_margins(figure.add_subplot(1, 3, 3), here)
    figure.savefig(path, dpi=110, bbox_inches="tight")


def kind_of(reach: Reach) -> str:
    """Returns the end of the path, in one word of the legend."""
    if math.degrees(reach.angle_rad) >= _WANTED_DEG - 0.05:
        return "reached"
    if "mm of each other" in reach.limit:
        return "touching"
    return "joint" if "limit of" in reach.limit else "reach"


def _draw_reach(axes: Any, here: Pose, others: Sequence[Pose]) -> None:
    """Draws angle over azimuth; the colour says what ends it."""
    axes.set_title("steepest tilt at each azimuth of the axis", fontsize=10)
    round_trip = [*here.reaches, here.reaches[0]]
    axes.plot(_azimuths(round_trip), _angles(round_trip), color="#888888", lw=1)
    for kind, colour in _COLOURS.items():
        found = [reach for reach in here.reaches if kind_of(reach) == kind]
        if found:
            axes.scatter(_azimuths(found), _angles(found), s=26, color=colour, zorder=3, label=_MEANINGS[kind])
    if others:
        best = [*others[0].reaches, others[0].reaches[0]]
        axes.plot(_azimuths(best), _angles(best), ls=":", marker="x", color="#1f5fa8", lw=1.2, label="best pose found")
    axes.set_ylim(0, 75)
    axes.set_yticks([20, 40, 60, _WANTED_DEG], ["20°", "40°", "", "67.5°"])
    axes.set_xticks([0, math.pi / 2, math.pi, 3 * math.pi / 2], ["dir 0", "dir 1", "dir 2", "dir 3"])
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.08), fontsize=8, ncols=2, frameon=False)


def _azimuths(reaches: Sequence[Reach]) -> list[float]:
    return [reach.azimuth_rad for reach in reaches]


def _angles(reaches: Sequence[Reach]) -> list[float]:
    return [math.degrees(reach.angle_rad) for reach in reaches]


def _draw_side(axes: Any, here: Pose) -> None:
    """Draws the arm at home and, faintly, at the steepest tilts towards and away from its base, in their plane."""
    stage = here.stage
    axes.set_title("from the side: level, and as far as it tilts", fontsize=10)
    for azimuth in _across(stage):
        joints = tilt_path(stage, azimuth_rad=azimuth).joints_rad[-1]
        _draw_arm(axes, stage, joints, strength=0.25)
    _draw_arm(axes, stage, stage.home_rad, strength=1.0)
    axes.axhline(0, color="#7a5c3a", lw=3)
    axes.set_aspect("equal")
    axes.set_xlabel("from the base towards the plate (m)")
    axes.set_ylabel("height (m)")


def _outward(stage: TiltStage) -> Array:
    """Returns the level unit vector from the base's axis to the pivot, (3,)."""
    away = (stage.pivot_m - stage.world_from_base[:3, 3]) * np.array([1.0, 1.0, 0.0])
    length = float(np.linalg.norm(away))
    return away / length if length > 1e-6 else np.array([1.0, 0.0, 0.0])


def _across(stage: TiltStage) -> tuple[float, float]:
    """Returns the azimuths whose tilts stay in the plane of base and pivot."""
    out = _outward(stage)
    azimuth = math.atan2(out[1], out[0]) + math.pi / 2
    return azimuth % math.tau, (azimuth + math.pi) % math.tau


def _draw_arm(axes: Any, stage: TiltStage, joints: Array, *, strength: float) -> None:
    links = stage.world_from_base @ link_transforms(stage.model, joints)
    frames = [stage.world_from_base, *links]
    shapes = [stage.model.base_capsule, *(joint.link_capsule for joint in stage.model.joints)]
    for number, (frame, shape) in enumerate(zip(frames, shapes, strict=True)):
        _draw_capsule(axes, stage, frame, shape, shade=0.35 + 0.07 * number, strength=strength)
    plate = links[-1] @ stage.model.last_from_flange @ stage.model.flange_from_plate
    side = 0.05 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0], [-1, -1, 0]])
    axes.plot(*_flat(stage, plate, side), color="#b3261e", lw=2, alpha=strength)


def _draw_capsule(axes: Any, stage: TiltStage, frame: Array, shape: Capsule, *, shade: float, strength: float) -> None:
    along, up = _flat(stage, frame, np.array([shape.from_m, shape.to_m]))
    axes.plot(along, up, color=str(shade), lw=160 * shape.radius_m, alpha=strength, solid_capstyle="round")


def _flat(stage: TiltStage, frame: Array, points_m: Array) -> tuple[Array, Array]:
    """Returns points (k, 3) of a frame, seen from the side: distance from the base's axis and height, (k,) each."""
    world = points_m @ frame[:3, :3].T + frame[:3, 3]
    return (world - stage.world_from_base[:3, 3]) @ _outward(stage), world[:, 2]


def _draw_margins(axes: Any, here: Pose) -> None:
    """Draws the margins at each azimuth: joint angles, clearance, speed and torque, each on its own scale."""
    axes.set_title("margins on the way to the steepest tilt", fontsize=10)
    azimuths = np.degrees(_azimuths(here.reaches))
    rows = (
        ("joint margin (°)", [math.degrees(reach.joint_margin_rad) for reach in here.reaches], "#c9731d"),
        ("clearance (mm)", [reach.clearance_m * 1000 for reach in here.reaches], "#b3261e"),
        ("fastest tilt (°/s)", [math.degrees(reach.rate_rad_s) for reach in here.reaches], "#1f5fa8"),
        ("holding torque (% of limit)", [100 * reach.torque_share for reach in here.reaches], "#444444"),
    )
    for label, values, colour in rows:
        axes.plot(azimuths, values, marker=".", color=colour, label=label)
    axes.set_xlabel("azimuth of the tilting axis (°)")
    axes.set_xticks(range(0, 361, 90))
    axes.set_ylim(bottom=0)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8, frameon=False)
