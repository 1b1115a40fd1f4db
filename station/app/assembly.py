"""Builds the parts of a station from a rig file: the twin's world, the arm's reach, the specimen, the nominal view."""

from __future__ import annotations

import math
from functools import cache
from importlib.resources import as_file, files
from pathlib import Path

import numpy as np

from shared.config import Table, load_table, parse, require_own_file
from shared.errors import UserError
from shared.geometry import plate_from_pixel
from shared.messages import CameraGeometry
from shared.rig import RigConfig, load_rig
from station.arm.planning import require_session
from station.arm.tilt_path import TiltStage
from station.arm.tilter import Tilter
from station.rig.arm_settings import arm_settings
from station.rig.opening import Opening
from station.rig.tilt import azimuth_of_direction
from station.sampling.machine import Reach, SamplingMachine
from station.sampling.plan import Plan
from station.sampling.run import Specimen
from station.simulators.mujoco.settings import TwinSettings
from station.simulators.mujoco.specimen import Block, Plate
from station.simulators.mujoco.world import TwinWorld


def simulated_rig_path() -> Path:
    """Returns the file of the rig that needs no hardware."""
    with as_file(files("station.app.rigs") / "simulated.toml") as path:
        return path


def rig_from(path: str | None) -> RigConfig:
    """Returns the rig of `--rig`, or the simulated one."""
    return load_rig(Path(path) if path else simulated_rig_path())


def sampling_machine(rig: RigConfig, plan: Plan, *, tilter: Tilter | None = None) -> SamplingMachine:
    """Returns the state machine for a rig and a plan.

    `tilter` is that of an arm agent in the same process, if there is one.
    """
    return SamplingMachine(
        plan,
        size_px=(rig.camera.width_px, rig.camera.height_px),
        reach=reach_of(rig, tilter=tilter),
        specimen=specimen(rig),
        geometry=None,
    )


def plan_from(path: str | None, *, samples: int | None, seed: int | None) -> Plan:
    """Returns the plan of `--plan`, or the paper's; `--samples` and `--seed` replace its own."""
    if samples is not None and samples < 1:
        raise UserError(f"Expected --samples to be 1 or more, got {samples}")
    table = load_table(Path(path)) if path else Table({})
    given = {"samples": samples, "seed": seed}
    values = {**table.values, **{key: value for key, value in given.items() if value is not None}}
    return parse(Plan, Table(values, table.file, table.text))


def specimen(rig: RigConfig) -> Specimen:
    """Returns the facts about block and plate that the samples carry."""
    length, width, _ = rig.block.size_m
    return Specimen(
        object=rig.block.name,
        plate=rig.plate.material,
        plate_mount_rad=math.radians(rig.plate.mount_deg),
        block_mass_kg=rig.block.mass_kg,
        block_area_m2=length * width,
        opening=Opening(radius_m=rig.plate.opening_m / 2, outline_m=rig.plate.opening_outline_m),
    )


def nominal_geometry(rig: RigConfig, *, stamp_ns: int = 0) -> CameraGeometry:
    """Returns the view that the rig file states, for want of a calibration: straight down at the plate's centre."""
    camera = rig.camera
    centre = ((camera.width_px - 1) / 2, (camera.height_px - 1) / 2)
    return CameraGeometry(
        stamp_ns=stamp_ns,
        plate_from_pixel=tuple(plate_from_pixel(px_per_m=camera.px_per_mm * 1e3, centre_px=centre).ravel().tolist()),
        mm_per_px=1.0 / camera.px_per_mm,
        marker_side_m=rig.mark.side_mm * 1e-3,
        marker_aspect=rig.mark.aspect,
        mark_height_m=rig.block.size_m[2],
        camera_height_m=camera.height_mm * 1e-3,
        source="nominal: rig.toml",
    )


def reach_of(rig: RigConfig, *, tilter: Tilter | None = None) -> Reach:
    """Returns the largest tilt (rad) of the rig's arm at an azimuth, by its kinematics and limits.

    A path is the arm's own property, so the paths that a `tilter` of the same rig has solved need no second solving.
    """
    settings = arm_settings(rig)
    paths = tilter or Tilter.from_settings(settings)
    ceiling = math.radians(settings.gate.max_tilt_deg)

    @cache
    def reach(azimuth_rad: float) -> float:
        return min(paths.path(azimuth_rad).reach_rad, ceiling)

    return reach


def require_reachable(rig: RigConfig, plan: Plan) -> Tilter:
    """Refuses a plan with a step that the arm cannot make. A free azimuth is chosen within what it can.

    Returns the rig's planner with the paths that had to be solved for that, for whoever needs them next.

    Raises:
        UserError: naming the direction, what stops the arm there, and the best alternative.
    """
    settings = arm_settings(rig)
    tilter = Tilter.from_settings(settings)
    if plan.direction.mode == "four" and not _reaches(tilter, plan):
        require_session(settings, angle_rad=plan.max_rad, directions=plan.direction.some)
    return tilter


def _reaches(tilter: Tilter, plan: Plan) -> bool:
    """Returns true if every direction of the plan is surely within reach; if not, somebody else says why."""
    try:
        return all(tilter.path(azimuth_of_direction(n)).reach_rad >= plan.max_rad for n in plan.direction.some)
    except UserError:
        return False


def twin_world(rig: RigConfig, *, seed: int, start_ns: int, stage: TiltStage | None = None) -> TwinWorld:
    """Returns the simulated world of a rig.

    The arm is at home (a known `stage` saves solving that), the block at the plate's centre.
    """
    require_own_file(rig.twin, "pair")
    settings = parse(TwinSettings, rig.twin)
    length, width, height = rig.block.size_m
    if not length == width == height:
        raise UserError(f"Expected a cube as size_m in [block] for the twin, got {rig.block.size_m}; give equal sides")
    _require_room(rig)
    stage = stage or Tilter.from_settings(arm_settings(rig)).stage
    return TwinWorld(
        stage.model,
        friction=settings.friction(),
        rng=np.random.default_rng(seed),
        joint_start_rad=stage.home_rad.tolist(),
        block=Block(side_m=length, mass_kg=rig.block.mass_kg),
        plate=Plate(
            side_m=rig.plate.side_m,
            cutout_radius_m=rig.plate.opening_m / 2,
            cutout_outline_m=rig.plate.opening_outline_m,
        ),
        start_ns=start_ns,
        world_from_base=stage.world_from_base,
    )


def _require_room(rig: RigConfig) -> None:
    """Refuses an opening of some outline in which the block cannot lie at the plate's middle, where the twin lays it.

    A round one was compared with the block as the rig file was read.
    """
    half_m, middle = np.array([rig.block.size_m[0] / 2]), (np.zeros(1), np.zeros(1), np.zeros(1))
    if specimen(rig).opening.room_m(half_m, middle)[0] < 0.0:
        raise UserError(
            f"Expected a block that lies at the plate's middle within the foam's opening for the twin, got [block] "
            f"size_m = {list(rig.block.size_m)}; give a smaller one, or another opening in [plate]"
        )
