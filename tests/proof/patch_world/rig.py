"""The rig of a case: its rig file, its plan, and what its camera and arm say of themselves."""

from __future__ import annotations

import math
import tomllib
from functools import cache

import numpy as np
from numpy.typing import NDArray

from shared.config import Table, parse
from shared.foxglove import CameraCalibration, Timestamp
from shared.messages import CameraGeometry
from shared.rig import RigConfig, rig_of_table
from station.arm.tilter import Tilter
from station.rig.arm_settings import ArmSettings
from station.sampling.plan import DirectionPlan, DwellPlan, Plan, TiltPlan
from tests.proof.patch_world import camera as cam
from tests.proof.patch_world.world import Contact

Array = NDArray[np.float64]
MODEL = "jaco2_spherical"
_ROW_RAD = math.radians(0.1)


def rig_toml(contact: Contact) -> str:
    """The rig file of a block and plate: of the plain world, before an effect changes what it says."""
    return f"""id = "patchworld"

[camera]
driver = "synthetic"
width_px = {cam.SIZE_PX}
height_px = {cam.SIZE_PX}
rate_hz = 90.0
plate_rate_hz = 15.0
px_per_mm = {cam.PX_PER_M * 1e-3}
height_mm = {cam.HEIGHT_M * 1e3}

[mark]
side_mm = {mark_side_m(contact) * 1e3:.4f}
margin = 0.1667
feature = "dot"

[plate]
material = "steel"
side_m = 0.1
opening_m = {2 * contact.wall_radius:.4f}
fiducial_side_mm = {cam.FIDUCIAL_SIDE_M * 1e3}
fiducial_place_mm = {cam.FIDUCIAL_M[1] * 1e3}

[block]
name = "slider"
material = "steel"
size_m = [{2 * contact.half_x:.5f}, {2 * contact.half_y:.5f}, {contact.height:.5f}]
mass_kg = {contact.mass:.6f}

[arm]
driver = "simulated"
model = "{MODEL}"
pivot_above_plate_m = {contact.pivot_height:.6f}
"""


def mark_side_m(contact: Contact) -> float:
    """The side of the mark (m): three quarters of the block's shorter one, to a hundredth of a millimetre."""
    return round(1.5 * min(contact.half_x, contact.half_y), 5)


def rig_config(text: str) -> RigConfig:
    """The rig of a rig file's text."""
    return rig_of_table(Table(tomllib.loads(text), "rig.toml", text))


def plan(*, runs: int, seed: int) -> Plan:
    """Tilts in free directions and at three rates, after rests that differ: what a careful experimenter would do."""
    return Plan(
        samples=runs,
        seed=seed,
        tilt=TiltPlan(
            steps=24, max_deg=48.0, adapt_after=12, rates_deg_s=(4.0, 8.0, 14.0), return_rate_deg_s=40.0, hold_s=0.1
        ),
        dwell=DwellPlan(min_s=0.3, max_s=5.0),
        direction=DirectionPlan(mode="free", min_slide_px=200.0),
    )


def geometry(contact: Contact, *, stamp_ns: int) -> CameraGeometry:
    """The calibration: the plate from the pixels, and the heights that the parallax needs."""
    scale = 1.0 / cam.PX_PER_M
    across = scale * cam.CENTRE_PX
    return CameraGeometry(
        stamp_ns=stamp_ns,
        plate_from_pixel=(scale, 0.0, -across, 0.0, -scale, across, 0.0, 0.0, 1.0),
        mm_per_px=scale * 1e3,
        marker_side_m=mark_side_m(contact),
        mark_height_m=contact.height,
        camera_height_m=cam.HEIGHT_M,
        source="patch world",
    )


def calibration(*, stamp_ns: int) -> CameraCalibration:
    """The lens: a pinhole without distortion, as far as anybody has measured."""
    f, c = cam.FOCAL_PX, cam.CENTRE_PX
    return CameraCalibration(
        timestamp=Timestamp.from_ns(stamp_ns),
        frame_id="camera",
        width=cam.SIZE_PX,
        height=cam.SIZE_PX,
        distortion_model="plumb_bob",
        D=(0.0, 0.0, 0.0, 0.0, 0.0),
        K=(f, 0.0, c, 0.0, f, c, 0.0, 0.0, 1.0),
        R=(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        P=(f, 0.0, c, 0.0, 0.0, f, c, 0.0, 0.0, 0.0, 1.0, 0.0),
    )


class Joints:
    """The arm's joint angles for a tilt: looked up between solutions of its kinematics, 0.1° apart."""

    def __init__(self, rig: RigConfig) -> None:
        self._tilter = Tilter.from_settings(parse(ArmSettings, rig.arm))
        self.names = tuple(self._tilter.stage.model.joint_names)
        self.pivot_m = tuple(float(value) for value in self._tilter.stage.pivot_m)
        self._table = cache(self._solve)

    def reach(self, azimuth: float) -> float:
        """The steepest tilt (rad) at an azimuth (rad)."""
        return self._tilter.path(azimuth).reach_rad

    def at(self, angle: float, *, azimuth: float) -> tuple[Array, Array]:
        """Joint angles (6) and their slopes by the tilt (6)."""
        angles, slopes = self._table(azimuth)
        place = max(angle, 0.0) / _ROW_RAD
        row = min(int(place), len(angles) - 2)
        return angles[row] + (place - row) * (angles[row + 1] - angles[row]), slopes[row]

    def _solve(self, azimuth: float) -> tuple[Array, Array]:
        path = self._tilter.path(azimuth)
        return path.at(np.arange(0.0, path.reach_rad, _ROW_RAD))
