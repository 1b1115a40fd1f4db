"""Says how far the arm can tilt at every azimuth, what stops it, and with what margins.

With --search it looks for poses in which the arm would do better. Joint limits, speeds, holding torques, and
collisions of the arm with itself, the table and the camera's mount count.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from station.app import assembly
from station.app.outputs import require_writable
from station.arm.collision import CollisionScene
from station.arm.kinematics import FULL, spherical
from station.arm.planning import Pose, Reach, assess, search
from station.arm.tilter import settled_model, settled_stage
from station.rig.arm_settings import ArmSettings
from station.rig.tilt import DIRECTIONS, azimuth_of_direction

NAME = "arm plan"
HELP = "how far can the arm tilt in each direction, and where would it stand better?"
EXAMPLE = "station arm plan --rig rig.toml"
ONE = "in some direction the arm does not reach 67.5 degrees"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument("--rig", help="rig file; without it the simulated rig that comes with Repose")
    parser.add_argument("--model", help="plan for this arm instead: a name in station/rig/models, or a file")
    parser.add_argument("--every-deg", type=float, default=15.0, help="distance between the azimuths looked at")
    parser.add_argument("--search", action="store_true", help="search other poses of the arm (a minute or two)")
    parser.add_argument("--four", action="store_true", help="search for the four directions only, not all azimuths")
    parser.add_argument("--picture", type=Path, default=Path("arm-plan.png"), help="where the picture goes")


def run(options: argparse.Namespace) -> int:
    """Returns 0 when the paper's 67.5 degrees are reached in all four directions, else 1."""
    require_writable(options.picture, what="picture (--picture FILE)")
    settings = _settings(options)
    model = settled_model(settings)
    stage = settled_stage(settings, model)
    scene = CollisionScene(model, world_from_base=stage.world_from_base, obstacles=settings.obstacles)
    azimuths = _azimuths(options.every_deg)
    here = assess(stage, scene=scene, azimuths_rad=azimuths)
    print(_report(here))
    four = assess(stage, scene=scene, azimuths_rad=[azimuth_of_direction(number) for number in range(DIRECTIONS)])
    print(_verdict(four))
    others = _search(settings, four=options.four) if options.search else []
    _picture(here, others, options.picture)
    print(f"Picture: {options.picture}")
    return 0 if four.worst_rad >= math.radians(67.5) - 1e-3 else 1


def _settings(options: argparse.Namespace) -> ArmSettings:
    if options.model:
        return ArmSettings(model=options.model)
    return assembly.arm_settings(assembly.rig_from(options.rig))


def _azimuths(every_deg: float) -> list[float]:
    count = max(4, round(360 / max(every_deg, 1.0)))
    return [math.tau * number / count for number in range(count)]


def _report(pose: Pose) -> str:
    head = "azimuth  reach   joint margin  clearance  fastest   torque   what ends it (angles in degrees)"
    return "\n".join([head, *(_line(reach) for reach in pose.reaches)])


def _line(reach: Reach) -> str:
    return (
        f"{math.degrees(reach.azimuth_rad):7.1f}  {math.degrees(reach.angle_rad):5.1f}   "
        f"{math.degrees(reach.joint_margin_rad):12.1f}  {reach.clearance_m * 1000:6.0f} mm  "
        f"{math.degrees(reach.rate_rad_s):5.1f}/s  {100 * reach.torque_share:5.0f} %   {reach.limit}"
    )


def _verdict(four: Pose) -> str:
    places = [f"{number}: {math.degrees(reach.angle_rad):.1f}" for number, reach in enumerate(four.reaches)]
    text = f"The four directions reach {', '.join(places)} degrees."
    best = int(np.argmax([reach.angle_rad for reach in four.reaches]))
    if four.worst_rad < math.radians(67.5) - 1e-3:
        text += f" For steeper tilts use direction {best} alone and turn the sample, or try --search."
    return text


def _search(settings: ArmSettings, *, four: bool) -> list[Pose]:
    """Searches, and prints the best as lines for rig.toml."""
    model = settled_model(settings)
    azimuths = np.arange(0, 360, 90 if four else 30) * math.pi / 180
    turns = [0.0] if len(model.joints) >= FULL and spherical(model) else np.radians(np.arange(0, 90, 15)).tolist()
    poses = _different(search(model, obstacles=settings.obstacles, azimuths_rad=azimuths, turns_rad=turns))[:5]
    for number, pose in enumerate(poses):
        print(f"\nPose {number + 1}: {math.degrees(pose.worst_rad):.1f} degrees at every azimuth looked at")
        print(_toml(pose))
    return poses


def _different(poses: Sequence[Pose]) -> list[Pose]:
    """Leaves out mirror images: poses that differ in nothing but the branch of the joints."""
    seen: dict[tuple[float, ...], Pose] = {}
    for pose in poses:
        seen.setdefault((round(pose.worst_rad, 3), round(pose.comfort, 3), *pose.stage.pivot_m.round(3)), pose)
    return list(seen.values())


def _toml(pose: Pose) -> str:
    base = pose.stage.world_from_base
    joints = ", ".join(f"{angle:.3f}" for angle in np.degrees(pose.stage.home_rad))
    yaw = math.degrees(math.atan2(base[1, 0], base[0, 0]))
    return f"[arm]\nbase_xyz_m = [0.0, 0.0, 0.0]\nbase_yaw_deg = {yaw:.1f}\nhome_deg = [{joints}]"


def _picture(here: Pose, others: Sequence[Pose], path: Path) -> None:
    from station.arm.plan_figure import draw_plan  # noqa: PLC0415 - matplotlib is slow to load

    draw_plan(here, others, path)
