"""The planner's memory: it knows at which tilt the arm stands, and plans its next motion."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from shared.errors import UserError
from shared.messages import TiltCommand
from station.arm.collision import CollisionScene
from station.arm.kinematics import pivot_pose
from station.arm.remembered import Remembered
from station.arm.tilt_path import TiltPath, TiltStage, tilt_path, tilt_stage
from station.arm.trajectory import TiltLimits, TiltMotion, TiltState, plan_rest, plan_tilt
from station.rig.arm_model import ArmModel, load_arm_model
from station.rig.arm_settings import ArmSettings
from station.rig.tilt import azimuth_of_direction, tilt_of_rotation

Array = NDArray[np.float64]
_LEVEL_RAD = math.radians(0.01)
_SAME_AZIMUTH_RAD = 1e-6
_LOST_RAD = math.radians(3.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """A planned motion that has not begun."""

    motion: TiltMotion


class Tilter:
    """The planner's memory: the stage, the paths and motions already solved, and the motion that was begun last."""

    def __init__(
        self,
        stage: TiltStage,
        *,
        limits: TiltLimits,
        max_angle_rad: float,
        settled_rad: float,
        scene: CollisionScene | None = None,
    ) -> None:
        """`settled_rad`: an arm whose joints are this near to a pose rests in it (the gate's own settle tolerance)."""
        self._stage = stage
        self._settled_rad = settled_rad
        self._scene = scene
        self._limits = limits
        self._max_angle_rad = max_angle_rad
        self._paths: dict[float, TiltPath] = {}
        self._motions = Remembered[tuple[float, TiltState, float, float], TiltMotion]()
        """The planned motions by azimuth, start, goal and rate."""
        self._motion: TiltMotion | None = None
        self._path: TiltPath | None = None
        self._rest = TiltState()

    @classmethod
    def from_settings(cls, settings: ArmSettings) -> Tilter:
        """Returns the tilter for the `[arm]` table of a rig; raises UserError when model and placement do not fit."""
        model = settled_model(settings)
        stage = settled_stage(settings, model)
        scene = CollisionScene(model, world_from_base=stage.world_from_base, obstacles=settings.obstacles)
        steepest = math.radians(min(settings.gate.max_tilt_deg, 67.5))
        settled = math.radians(settings.gate.settle_tolerance_deg)
        return cls(stage, limits=TiltLimits(), max_angle_rad=steepest, settled_rad=settled, scene=scene)

    @property
    def stage(self) -> TiltStage:
        """The arm in its place, with its home pose."""
        return self._stage

    @property
    def located(self) -> bool:
        """True if it is known at which tilt the arm stands."""
        return self._path is not None

    def path(self, azimuth_rad: float) -> TiltPath:
        """Returns the tilt path at an azimuth, solved once."""
        key = round(azimuth_rad % (2 * math.pi), 9)
        if key not in self._paths:
            self._paths[key] = self._solved(key)
        return self._paths[key]

    def _solved(self, azimuth_rad: float) -> TiltPath:
        touching = self._scene.touching if self._scene else None
        return tilt_path(self._stage, azimuth_rad=azimuth_rad, max_angle_rad=self._max_angle_rad, touching=touching)

    def locate(self, joints_rad: Array) -> None:
        """Finds the tilt at which the arm stands from `joints_rad` (n,), rad, for example after a restart in mid-tilt.

        It is level, or a tilt of a path that is known already, where the arm is as near to that as to the end of a
        motion at which it counts as arrived: the azimuth of a plate that is almost level is noise, and a plate is
        tilted further at its own azimuth alone.

        Raises UserError when the arm stands in none: then it must be brought home by the maker's own means.
        """
        self._align_turns(joints_rad)
        world_from_plate = self._stage.world_from_base @ pivot_pose(self._stage.model, joints_rad)
        angle, azimuth = tilt_of_rotation(world_from_plate[:3, :3])
        for known in (self.path(0.0), *self._paths.values()):
            for along in (0.0, max(angle * math.cos(azimuth - known.azimuth_rad), 0.0)):
                if float(np.abs(known.at(np.array([along]))[0][0] - joints_rad).max()) <= self._settled_rad:
                    self._stand(known, along)
                    return
        # A measured azimuth is never met again, so its path is not kept.
        path = self._solved(azimuth % (2 * math.pi)) if angle > _LEVEL_RAD else self.path(0.0)
        away = np.abs(path.at(np.array([angle]))[0][0] - joints_rad)
        joint = int(away.argmax())
        if not away[joint] <= _LOST_RAD:
            raise UserError(
                f"The arm is not in its home pose, nor tilted from it: {self._stage.model.joints[joint].name} is "
                f"{math.degrees(away[joint]):.1f} degrees off; move it there with the maker's own tool."
            )
        self._stand(path, angle)

    def _stand(self, path: TiltPath, angle_rad: float) -> None:
        self._path, self._motion = path, None
        self._rest = TiltState(angle_rad=angle_rad)

    def forget(self) -> None:
        """Notes that the arm may stand anywhere: `locate` finds out."""
        self._path = self._motion = None
        self._rest = TiltState()

    def _align_turns(self, joints_rad: Array) -> None:
        """Counts the full turns of endless joints as the arm does."""
        endless = ~np.isfinite(self._stage.model.lower_rad)
        turns = np.where(endless, np.round((joints_rad - self._stage.home_rad) / (2 * math.pi)), 0.0)
        if np.any(turns):
            self._stage = replace(self._stage, home_rad=self._stage.home_rad + 2 * math.pi * turns)
            self._paths.clear()
            self._motions.clear()

    def state(self, elapsed_ns: int) -> TiltState:
        """Returns the commanded tilt now, `elapsed_ns` after the last motion began (of no account while at rest)."""
        return self._motion.state(elapsed_ns) if self._motion else self._rest

    def plan(self, command: TiltCommand, *, elapsed_ns: int, rate_rad_s: float) -> Plan:
        """Plans a command from where the arm is now.

        A tilt can go on at its own azimuth at any time, also in mid-motion; another azimuth is reached from level
        only. Level (angle 0) is the end of every azimuth. Raises UserError with the reason of a refusal.
        """
        now = self.state(elapsed_ns)
        azimuth = command_azimuth(command)
        path = self._path if self._path is not None else self.path(azimuth)
        turned = abs(math.remainder(azimuth - path.azimuth_rad, 2 * math.pi)) > _SAME_AZIMUTH_RAD
        if turned and abs(command.angle_rad) > 0:
            if now.angle_rad > _LEVEL_RAD or abs(now.rate_rad_s) > 0:
                raise UserError(
                    f"The plate is tilted by {math.degrees(now.angle_rad):.1f} degrees at azimuth "
                    f"{math.degrees(path.azimuth_rad):.1f}: level it before tilting at {math.degrees(azimuth):.1f}."
                )
            path, now = self.path(azimuth), TiltState()
        return Plan(motion=self._tilt(path, start=now, angle_rad=command.angle_rad, rate_rad_s=rate_rad_s))

    def _tilt(self, path: TiltPath, *, start: TiltState, angle_rad: float, rate_rad_s: float) -> TiltMotion:
        """Returns the motion to an angle.

        One from rest is planned once, because the steps of a session are the same each run.

        Raises UserError when it cannot be planned.
        """
        key = (path.azimuth_rad, start, angle_rad, rate_rad_s)
        if (known := self._motions.get(key)) is not None and known.path is path:
            return known
        model, limits = self._stage.model, self._limits
        motion = plan_tilt(model, path, start=start, angle_rad=angle_rad, rate_rad_s=rate_rad_s, limits=limits)
        if start.rate_rad_s == 0.0:
            self._motions.put(key, motion)
        return motion

    def plan_hold(self, *, elapsed_ns: int) -> Plan:
        """Plans to bring the motion under way to rest as soon as the limits allow."""
        if self._path is None:
            raise UserError("There is no motion to bring to rest.")
        return Plan(motion=plan_rest(self._path, start=self.state(elapsed_ns), limits=self._limits))

    def begin(self, plan: Plan) -> None:
        """Notes that the planned motion has begun."""
        self._motion, self._path = plan.motion, plan.motion.path

    def arrive(self) -> None:
        """Notes that the motion has come to its end."""
        if self._motion is not None:
            self._rest, self._motion = self._motion.goal, None


def settled_model(settings: ArmSettings) -> ArmModel:
    """Returns the arm's model with the pivot that the `[arm]` table asks for."""
    model = load_arm_model(settings.model)
    if settings.pivot_above_plate_m is None:
        return model
    return replace(model, pivot_above_plate_m=settings.pivot_above_plate_m)


def settled_stage(settings: ArmSettings, model: ArmModel) -> TiltStage:
    """Returns the arm as the `[arm]` table places it; what it leaves out is the model's own home."""
    return tilt_stage(
        model,
        base_xyz_m=settings.base_xyz_m,
        base_yaw_rad=settings.base_yaw_rad(model.home_yaw_rad),
        home_rad=settings.home_rad(model.home_rad),
    )


def command_azimuth(command: TiltCommand) -> float:
    """Returns the azimuth that a command means: its direction's own, or `azimuth_rad` when the direction is -1.

    Raises UserError for numbers that are not finite, a direction that does not exist, or one that contradicts the
    azimuth beside it.
    """
    if not (math.isfinite(command.angle_rad) and math.isfinite(command.azimuth_rad)):
        raise UserError(f"Expected a finite angle and azimuth, got {command.angle_rad} and {command.azimuth_rad}.")
    if command.direction == -1:
        return command.azimuth_rad
    try:
        azimuth = azimuth_of_direction(command.direction)
    except ValueError as wrong:
        raise UserError(f"Expected a direction 0 to 3, or -1 for a free azimuth: {wrong}.") from None
    if command.azimuth_rad and abs(math.remainder(command.azimuth_rad - azimuth, 2 * math.pi)) > 1e-3:
        raise UserError(
            f"Direction {command.direction} means the azimuth {math.degrees(azimuth):.0f} degrees, but the command "
            f"says {math.degrees(command.azimuth_rad):.1f}."
        )
    return azimuth
