"""Defines what a user's function gets and gives back: the contract that README.md of this folder explains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from station.physics.contact import GRAVITY_M_S2, Array
from station.simulators.planar.plate import Plate, gravity_at


@dataclass(frozen=True, eq=False, kw_only=True)
class Run:
    """One run's commands, in SI units. P is the plate's frame: origin in its middle, z its normal, up when level.

    Attributes:
        number: the run's index in the session, from 0.
        seed: for whatever the function draws; always the same for the same run.
        t_s: (k,) s, some 10 ms apart, from 0 at the run's beginning to `end_s`.
        gravity_m_s2: (k, 3) gravity's acceleration in P at these times; (0, 0, −9.81) on a level plate.
        rate_rad_s, acceleration_rad_s2: (k, 3) the plate's angular velocity and acceleration, in P.
        end_s: the end of the run.
        x_m, y_m, yaw_rad: where the block lies in P when the run begins: the middle of its sole, and its heading.
        vx_m_s, vy_m_s, yaw_rate_rad_s: its velocity then; 0 but for a block that was thrown.
        rest_s: how long it had lain there.
        block_mass_kg, block_side_m: the block, whose sole is a square.
        opening_radius_m: radius of the opening in the foam round the plate's middle; inf without foam.
        opening_outline_m: corners (x, y) of an opening that is not round, one after another; empty: it is.
        temperature_c, relative_humidity: the air; nan where unknown.
    """

    number: int
    seed: int
    t_s: Array
    gravity_m_s2: Array
    rate_rad_s: Array
    acceleration_rad_s2: Array
    end_s: float
    x_m: float
    y_m: float
    yaw_rad: float
    vx_m_s: float
    vy_m_s: float
    yaw_rate_rad_s: float
    rest_s: float
    block_mass_kg: float
    block_side_m: float
    opening_radius_m: float
    temperature_c: float
    relative_humidity: float
    opening_outline_m: tuple[tuple[float, float], ...] = ()

    @property
    def tilt_rad(self) -> Array:
        """The angle (k,) between the plate's normal and up."""
        return np.arctan2(np.hypot(*self.gravity_m_s2[:, :2].T), -self.gravity_m_s2[:, 2])

    @property
    def world_from_plate(self) -> Array:
        """Quaternions (k, 4), w x y z, of the plate's attitude, for an engine that turns a plate.

        The plate is turned from level about a horizontal axis; a turn about the vertical changes no load.
        """
        x, y, z = (self.gravity_m_s2 / GRAVITY_M_S2).T
        found = np.column_stack([1.0 - z, -y, x, np.zeros(len(x))])
        return found / np.linalg.norm(found, axis=1, keepdims=True)


@dataclass(frozen=True, eq=False, kw_only=True)
class Path:
    """The block's path in P: `t_s`, `x_m`, `y_m`, `yaw_rad` (k,), and its onset, s, if the function knows it.

    Without `onset_s` the slide is traced back to where it began.
    """

    t_s: Array
    x_m: Array
    y_m: Array
    yaw_rad: Array
    onset_s: float | None = None


def run_of(plate: Plate) -> Run:
    """Returns the run of a plate's commands, which have a single row: the plate is as it truly stands and moves."""
    commands = plate.commands
    number = np.arange(plate.knots)
    stretch = plate.stretch(np.zeros(len(number), dtype=np.intp), np.minimum(number, plate.knots - 2))
    t_s = commands.time_s[0]
    last = np.append(number[:-1], plate.knots - 2)
    chosen = np.append(np.diff(t_s) > 0, False)
    chosen[int(chosen.sum())] = True  # a shorter run repeats its last knot
    (x_m, y_m, yaw_rad), (vx_m_s, vy_m_s, yaw_rate) = commands.start[0].tolist(), commands.velocity[0].tolist()
    return Run(
        number=int(commands.run[0]),
        seed=int(commands.run[0]),
        t_s=t_s[chosen],
        gravity_m_s2=np.column_stack(gravity_at(stretch, t_s))[chosen],
        rate_rad_s=commands.rate_rad_s[0, last][chosen],
        acceleration_rad_s2=commands.acceleration_rad_s2[0, last][chosen],
        end_s=float(commands.end_s[0]),
        x_m=x_m,
        y_m=y_m,
        yaw_rad=yaw_rad,
        vx_m_s=vx_m_s,
        vy_m_s=vy_m_s,
        yaw_rate_rad_s=yaw_rate,
        rest_s=float(commands.rest_s[0]),
        block_mass_kg=float(commands.mass_kg[0]),
        block_side_m=float(np.sqrt(commands.area_m2[0])),
        opening_radius_m=commands.border_m,
        opening_outline_m=commands.outline_m,
        temperature_c=float(commands.temperature_c[0]),
        relative_humidity=float(commands.relative_humidity[0]),
    )
