"""A run in a user's scene: gravity turns instead of the plate, and what was found acts on the block's friction."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from shared.errors import UserError
from station.physics.contact import Array
from station.physics.model import Model
from station.simulators.mujoco.bindings import mj
from station.simulators.planar.commands import Commands
from station.simulators.planar.plate import Plate
from station.simulators.scene.bodies import Scene
from station.simulators.yours.answer import Answer, answer_of
from station.simulators.yours.found import Found, needs_telling
from station.simulators.yours.run import Run, run_of

SETTLE_S = 0.3
"""A block lies so long on the level plate before its run: MuJoCo's own contacts settle in 0.1 s (three solref[0] of
0.02 s); with none the first frames would show it sink (tests/unit/simulators/test_scene.py)."""
STORED_S = 0.005
"""A place is stored at least so often: twice between two frames of a camera of 90 Hz."""
HELD = 0.8
"""A block that needs less of its friction takes several steps, up to the next place that is stored, with one load."""
STILL_M_S = 1e-3
"""A block that its friction can hold again rests when it is slower; MuJoCo's contact never stops it wholly."""

_Pose = tuple[float, float, float]
_Velocity = tuple[float, float]


class Driver:
    """Simulates runs in one scene, one after another."""

    def __init__(self, path: Path) -> None:
        """Reads the scene.

        Raises:
            UserError: as `Scene` does.
        """
        self.scene, self._path = Scene(path), path
        model = self.scene.model
        geoms, pairs = self.scene.touching
        self._geoms, self._pairs = model.geom_friction[geoms].copy(), model.pair_friction[pairs].copy()
        self._gravity = model.opt.gravity.copy()
        self.mu = float(self._pairs[:, 0].max() if len(pairs) else self._geoms[:, 0].max())

    def __call__(self, commands: Commands, model: Model, friction: float) -> Answer:
        """Simulates one run: commands with a single row, what to change, and the run's own factor on the friction.

        Raises:
            UserError: if the scene is unstable, or the block is lost.
        """
        run = run_of(Plate(commands, model))
        found = Found(model, commands, friction=friction) if needs_telling(model, friction) else None
        self._begin(run)
        table = self._followed(run, found)
        if self.scene.data.warning[mj.mjtWarning.mjWARN_BADQACC].number:
            raise UserError("the scene became unstable (MuJoCo: bad qacc); use a smaller time step")
        try:
            return answer_of(table, run)
        except ValueError as error:
            raise UserError(str(error)) from error

    def _begin(self, run: Run) -> None:
        """Lays the block down and lets it settle on the plate as it stands at first."""
        scene = self.scene
        mj.mj_resetData(scene.model, scene.data)
        start = run.x_m, run.y_m, run.yaw_rad
        scene.lay(*start, (0.0, 0.0, 0.0))
        self._multiply(1.0)
        scene.model.opt.gravity[:] = scene.turn @ run.gravity_m_s2[0]
        mj.mj_step(scene.model, scene.data, max(1, round(SETTLE_S / scene.model.opt.timestep)))
        height = scene.data.qpos[scene.qpos][:3] @ scene.turn[:, 2]
        scene.lay(*start, (run.vx_m_s, run.vy_m_s, run.yaw_rate_rad_s))
        place = scene.data.qpos[scene.qpos][:3]
        scene.data.qpos[scene.qpos.start : scene.qpos.start + 3] += (height - place @ scene.turn[:, 2]) * scene.turn[
            :, 2
        ]
        mj.mj_forward(scene.model, scene.data)
        scene.stand()

    def _followed(self, run: Run, found: Found | None) -> Array:
        """Returns rows of t, x, y, yaw (k, 4)."""
        scene, step_s = self.scene, float(self.scene.model.opt.timestep)
        every = max(1, int(STORED_S / step_s))
        times = np.arange(0.0, run.end_s + every * step_s, step_s)
        load = _Loads(run, times)
        rows, began = [(0.0, *scene.pose())], 0.0 if run.vx_m_s or run.vy_m_s else math.inf
        number = 0
        while times[number] < run.end_s:
            pose, velocity = scene.pose(), scene.velocity()
            pull = load.at(number, pose, velocity)
            scene.model.opt.gravity[:] = scene.turn @ pull
            if found is not None:
                began = self._set_found(
                    found, float(times[number]), pose=pose, velocity=velocity, pull=pull, began=began
                )
            quiet = math.isinf(began) and math.hypot(*velocity) < STILL_M_S and self._holds(pull)
            steps = every if quiet else 1
            mj.mj_step(scene.model, scene.data, steps)
            number += steps
            mj.mj_kinematics(scene.model, scene.data)
            rows.append((float(times[number]), *scene.pose()))
        table = np.array(rows)
        table[:, 3] = run.yaw_rad + np.unwrap(table[:, 3]) - table[0, 3]
        return table

    def _set_found(
        self, found: Found, time_s: float, *, pose: _Pose, velocity: _Velocity, pull: Array, began: float
    ) -> float:  # fmt: skip
        """Sets what was found for the next step; gives when the present slide began (inf: the block rests)."""
        scene = self.scene
        state = {"t_s": time_s, "x_m": pose[0], "y_m": pose[1], "yaw_rad": pose[2]}
        pressing, along, speed = max(-float(pull[2]), 0.0), math.hypot(pull[0], pull[1]), math.hypot(*velocity)
        if math.isinf(began) or speed < STILL_M_S:
            held = self.mu * float(found.friction_multiplier(**state))
            began = math.inf if along <= held * pressing else min(began, time_s)
        if began <= time_s:
            way = (velocity[0] / speed, velocity[1] / speed) if speed > 0 else (pull[0] / along, pull[1] / along)
            speed = max(speed, 1e-9)
            state |= {"vx_m_s": way[0] * speed, "vy_m_s": way[1] * speed, "slid_from_s": began}
        factor = float(found.friction_multiplier(**state))
        self._multiply(factor)
        force = scene.mass_kg * (scene.turn @ found.force_per_mass(**state))
        turning = 0.0
        if began <= time_s:
            turning = float(found.angular_acceleration(friction_m_s2=self.mu * factor * pressing, **state))
        inertia = scene.data.cinert[scene.block][:3].max() if turning else 0.0
        scene.data.xfrc_applied[scene.block] = [*force, *(turning * inertia * scene.turn[:, 2])]
        return began

    def _holds(self, pull: Array) -> bool:
        """Returns true if the block needs less than HELD of its friction as it is set now."""
        geoms, pairs = self.scene.touching
        model = self.scene.model
        mu = model.pair_friction[pairs, 0].max() if len(pairs) else model.geom_friction[geoms, 0].max()
        return math.hypot(pull[0], pull[1]) < HELD * float(mu) * -float(pull[2])

    def _multiply(self, factor: float) -> None:
        geoms, pairs = self.scene.touching
        self.scene.model.geom_friction[geoms] = factor * self._geoms
        self.scene.model.pair_friction[pairs] = factor * self._pairs
        self.scene.data.xfrc_applied[self.scene.block] = 0.0


class _Loads:
    """The acceleration of what nothing holds on the plate, at every step of a run."""

    def __init__(self, run: Run, times: Array) -> None:
        def at_steps(values: Array) -> Array:
            return np.column_stack([np.interp(times, run.t_s, axis) for axis in values.T])

        self._gravity = at_steps(run.gravity_m_s2)
        self._rate, self._bend = at_steps(run.rate_rad_s).tolist(), at_steps(run.acceleration_rad_s2).tolist()

    def at(self, number: int, pose: _Pose, velocity: _Velocity) -> Array:
        """Returns g − α × r − ω × (ω × r) − 2 ω × v (3,), m/s², in the plate's frame, with r and v in the plate."""
        (wx, wy, wz), (ax, ay, az), (x, y, _), (vx, vy) = self._rate[number], self._bend[number], pose, velocity
        inward, square = wx * x + wy * y, wx * wx + wy * wy + wz * wz
        inertial = (
            az * y + square * x - wx * inward + 2.0 * wz * vy,
            -az * x + square * y - wy * inward - 2.0 * wz * vx,
            ay * x - ax * y - wz * inward + 2.0 * (wy * vx - wx * vy),
        )
        return self._gravity[number] + inertial
