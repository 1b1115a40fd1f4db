"""The `[arm]` table of rig.toml: which arm, where it stands, and how far it may be trusted."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from shared.config import Table, parse, require_own_file
from shared.rig import RigConfig

LONGEST_TILT_S = 600.0
"""No tilt lasts longer: 67.5 degrees at 0.12 degrees/s, where a rig tilts at some degrees/s. The set-points of a motion
lie in memory, and a command at 1e-5 degrees/s took 22 GB of it (test_gate.py's hostile streams)."""

_STARTS_S = 10.0
"""Seconds of it for getting up to speed and back, which take 1 s at the usual rates."""


@dataclass(frozen=True, kw_only=True)
class GateSettings:
    """The `[arm.gate]` table: the limits of the safety gate.

    A joint may use `velocity_share` and `acceleration_share` of the model's limits. The measured pose may be
    `follow_tolerance_deg` away from the commanded one for `follow_timeout_s`. Without the station's heartbeat for
    `heartbeat_timeout_s` the arm holds, and `level_after_s` later it levels at `level_rate_deg_s`. The pivot may stray
    `pivot_tolerance_m`, one command may turn a joint by `max_joint_step_deg`.
    """

    max_tilt_deg: float = 68.0
    pivot_tolerance_m: float = 0.003
    velocity_share: float = 1.0
    acceleration_share: float = 1.0
    max_joint_step_deg: float = 200.0
    start_tolerance_deg: float = 2.0
    follow_tolerance_deg: float = 2.0
    follow_timeout_s: float = 0.3
    silence_timeout_s: float = 0.5
    settle_tolerance_deg: float = 0.3
    settle_timeout_s: float = 3.0
    heartbeat_timeout_s: float = 1.0
    level_after_s: float = 5.0
    level_rate_deg_s: float = 3.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"expected a positive number for '{name}', got {value}")
        if not self.max_tilt_deg / self.level_rate_deg_s < LONGEST_TILT_S - _STARTS_S:
            slowest = self.max_tilt_deg / (LONGEST_TILT_S - _STARTS_S)
            raise ValueError(
                f"expected at least {slowest:.2g} degrees/s for 'level_rate_deg_s', so that a plate tilted by "
                f"{self.max_tilt_deg:g} degrees is level within {LONGEST_TILT_S:.0f} s, got {self.level_rate_deg_s:g}"
            )


@dataclass(frozen=True, kw_only=True)
class ObstacleSettings:
    """The `[arm.obstacles]` table: what the arm must not touch, and what it carries.

    The table's top is at `table_m` in the world, `walls_m` are further boxes (x, y, z of the centre, then the three
    full sizes). On the plate, which has `plate_side_m`, four posts hold the camera, a box of `camera_size_m`, at
    `camera_height_m` above it (0: there is no camera mount). Parts keep `clearance_m` from each other.
    """

    table_m: float = 0.0
    walls_m: tuple[tuple[float, float, float, float, float, float], ...] = ()
    plate_side_m: float = 0.1
    camera_height_m: float = 0.3
    camera_size_m: tuple[float, float, float] = (0.1, 0.1, 0.03)
    clearance_m: float = 0.005

    def __post_init__(self) -> None:
        if min(self.plate_side_m, self.clearance_m, *self.camera_size_m) <= 0 or self.camera_height_m < 0:
            raise ValueError("expected positive plate_side_m, camera_size_m and clearance_m, and no negative height")


@dataclass(frozen=True, kw_only=True)
class ArmSettings:
    """The `[arm]` table. `model` is a name in station/rig/models or a file; `driver` a name in station/arm/drivers.

    The base stands upright at `base_xyz_m`, turned by `base_yaw_deg` (the model's own by default); the world's axes are
    the level plate's.
    `home_deg` holds the plate level (empty: the model's own home pose). `rate_deg_s` is the tilt rate of a command
    that names none. `pivot_above_plate_m` replaces the model's when it is given. `armed` lets the arm
    move when the station asks for it; a real arm is read-only until it is set. `options` goes to the driver.
    """

    model: str = "jaco2_spherical"
    driver: str = "simulated"
    base_xyz_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    base_yaw_deg: float | None = None
    home_deg: tuple[float, ...] = ()
    rate_deg_s: float = 5.0
    pivot_above_plate_m: float | None = None
    armed: bool | None = None
    gate: GateSettings = field(default_factory=GateSettings)
    obstacles: ObstacleSettings = field(default_factory=ObstacleSettings)
    options: Table = field(default_factory=lambda: Table({}))

    def base_yaw_rad(self, home_yaw_rad: float) -> float:
        """Returns the base's yaw; `home_yaw_rad` is the model's own."""
        return home_yaw_rad if self.base_yaw_deg is None else math.radians(self.base_yaw_deg)

    def home_rad(self, own: Sequence[float]) -> Sequence[float]:
        """Returns the home pose; `own` is the model's."""
        return [math.radians(angle) for angle in self.home_deg] or own

    @property
    def may_arm(self) -> bool:
        """True if the rig lets the arm move; the twin may always."""
        return self.driver == "simulated" if self.armed is None else self.armed


def arm_settings(rig: RigConfig) -> ArmSettings:
    """Returns the `[arm]` table of a rig.

    Raises:
        UserError: if it is wrong, or the rig inside a recording names a file as the arm's model.
    """
    require_own_file(rig.arm, "model")
    return parse(ArmSettings, rig.arm)
