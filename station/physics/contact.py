"""The state of a block on the plate, and the camera's view of it, at many moments at once."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from shared.vectors import columns

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
T = TypeVar("T")
GRAVITY_M_S2 = 9.81


@dataclass(frozen=True, eq=False, kw_only=True)
class Contact:
    """The block on the plate at n moments; arrays of shape (n,) unless said otherwise. P is the plate frame.

    What follows from the fields is worked out once: many models are evaluated on the same contact.

    Attributes:
        run: number of the run, counted from 0 at the session's first run (float).
        moving: False at rest and at the onset, True while sliding.
        way_rad: direction in P of the sliding, or of the sliding that would begin.
        speed_m_s: speed of the sliding; 0 at rest.
        x_m, y_m: place of the mark's centre in P.
        yaw_rad: heading of the block in P.
        rest_s: dwell under load up to now; while sliding, the dwell before the slide.
        slid_s: time since the slide began; 0 at rest.
        tilt_rad: angle between the plate's normal and up.
        down_rad: direction in P of the steepest descent.
        rate_rad_s, acceleration_rad_s2: (n, 3) angular velocity and acceleration of the plate, in P.
        rising: +1 while the tilt grows (or grew last), −1 while it falls.
        gone_rad: angle by which the tilt has gone on since it last turned round, ≥ 0; inf where that is unknown.
        swing_rad: (n, 3) angles by which it had swung before, back and forth, the last first; inf where unknown. Swings
            that are gone through again count as none, see `reversals`.
        step_s: time since the present or last tilt step began.
        mount_rad: turn of the plate in its mount: the angle from P, which the camera and the arm share, to the plate's
            own grain.
        mass_kg, area_m2: mass of the block and area of its contact.
        border_m: distance from the block's edge to the foam, negative inside it; inf where there is none.
        temperature_c, relative_humidity: state of the air; nan where unknown.
        spare_m_s2: the distance of a block at rest to its limit: what friction holds there, in this run, less what
            pulls, per mass; nan where only the model's own friction is known (`Model.creep` puts that in its place).
    """

    run: Array
    moving: Bools
    way_rad: Array
    speed_m_s: Array
    x_m: Array
    y_m: Array
    yaw_rad: Array
    rest_s: Array
    slid_s: Array
    tilt_rad: Array
    down_rad: Array
    rate_rad_s: Array
    acceleration_rad_s2: Array
    rising: Array
    gone_rad: Array
    swing_rad: Array
    step_s: Array
    mount_rad: Array
    mass_kg: Array
    area_m2: Array
    border_m: Array
    temperature_c: Array
    relative_humidity: Array
    spare_m_s2: Array

    def __len__(self) -> int:
        return len(self.run)

    def chosen(self, rows: NDArray[np.int64]) -> Contact:
        """Returns the moments with the indices `rows` (m,); an index may repeat."""
        return Contact(**{each.name: getattr(self, each.name)[rows] for each in fields(self)})

    def facing(self, way_rad: Array) -> Contact:
        """Returns the same contacts with other directions of sliding `way_rad` (n,), rad in P."""
        return _other(self, way_rad=way_rad)

    def changed(self, **changed: Array) -> Contact:
        """Returns the same contacts with some fields `changed`.

        `dataclasses.replace` would forget all that was worked out.
        """
        return _other(self, **changed)

    @cached_property
    def pressing_m_s2(self) -> Array:
        """Gravity's normal component g cos θ (n,), m/s²: a plain block's normal force per mass."""
        return GRAVITY_M_S2 * np.cos(self.tilt_rad)

    @cached_property
    def pulling_m_s2(self) -> Array:
        """Gravity's component down the slope g sin θ (n,), m/s²."""
        return GRAVITY_M_S2 * np.sin(self.tilt_rad)

    @cached_property
    def down(self) -> Array:
        """Unit vector of the steepest descent in P (n, 2)."""
        return unit(self.down_rad)

    @cached_property
    def way(self) -> Array:
        """Unit vector of the sliding in P (n, 2)."""
        return unit(self.way_rad)

    @cached_property
    def gravity(self) -> Array:
        """Gravity's unit vector in P (n, 3)."""
        level = np.sin(self.tilt_rad)
        return columns(level * self.down[:, 0], level * self.down[:, 1], -np.cos(self.tilt_rad))

    @cached_property
    def tilt_axis(self) -> Array:
        """Unit vector in P (n, 3) about which a positive tilt has turned the plate from level: normal × descent.

        It is the same in the world's frame, as long as the arm tilts the plate without turning it about its normal.
        """
        return columns(-self.down[:, 1], self.down[:, 0], np.zeros(len(self)))


@dataclass(frozen=True, eq=False, kw_only=True)
class View:
    """The camera's view of a mark at n moments: its corners' true places, and what may displace their images.

    Attributes:
        point_m: (n, 4, 2) the mark's true corners in P.
        on_block: False for a fiducial that is fixed to the plate.
        velocity_m_s: (n, 2) velocity of the mark's centre in P; 0 for a fiducial.
        acceleration_m_s2: (n, 2) its acceleration, or one for all.
        yaw_rate_rad_s: (n,) turning rate of the mark.
        tilt_rad, down_rad: (n,) as in `Contact`.
        rest_s: (n,) time since this run's tilt began: how long the block has been held on a slope.
        limit_rad: (n,) the tilt at which this run's block slides; nan where that is unknown.
        crept_m: (n,) the way that a block as near to its limit may have crept, or one for all.
        side_m: side of the block's mark.
        camera_height_m: height of the lens above the plate.
        image_centre_m: (2,) the place in P that the optical axis meets.
        row_m: (2,) unit vector in P along which the image's rows are exposed one after another (image down).
        image_size_m: height of the field of view on the plate.
    """

    point_m: Array
    on_block: bool
    velocity_m_s: Array
    yaw_rate_rad_s: Array
    tilt_rad: Array
    down_rad: Array
    rest_s: Array
    limit_rad: Array
    side_m: float
    camera_height_m: float
    image_centre_m: Array
    row_m: Array
    image_size_m: float
    acceleration_m_s2: Array | float = 0.0
    crept_m: Array | float = 0.0

    def of(self, point_m: Array) -> View:
        """Returns the same view of a mark whose true corners are at `point_m` (n, 4, 2), m, in P."""
        return _other(self, point_m=point_m)

    def shifted(self, shift_m: Array) -> Array:
        """Returns the displacements (n, 4, 2), m, of marks whose corners all move by `shift_m` (n, 2), m."""
        return np.broadcast_to(shift_m[:, None, :], self.point_m.shape)

    def moving(self, velocity_m_s: Array, acceleration_m_s2: Array | float) -> View:
        """Returns the same view of a mark that moves in P at `velocity_m_s` (n, 2), m/s, and otherwise gains speed.

        `acceleration_m_s2` is (n, 2), m/s², or one for all.
        """
        return _other(self, velocity_m_s=velocity_m_s, acceleration_m_s2=acceleration_m_s2)

    def later(self, late_s: Array) -> View:
        """Returns the view of a mark each of whose corners has gone on for a time of its own, `late_s` (n, 4), s."""
        out, late = self.point_m - self.centre_m[:, None, :], late_s[..., None]
        turning = self.yaw_rate_rad_s[:, None, None] * np.stack([-out[..., 1], out[..., 0]], axis=-1)
        gained = np.broadcast_to(self.acceleration_m_s2, self.velocity_m_s.shape)[:, None, :]
        return self.of(self.point_m + late * (self.velocity_m_s[:, None, :] + turning + 0.5 * late * gained))

    @cached_property
    def centre_m(self) -> Array:
        """The mark's centre (n, 2)."""
        return middle(self.point_m)

    @cached_property
    def down(self) -> Array:
        """Unit vector of the steepest descent in P (n, 2)."""
        return unit(self.down_rad)


FOLLOWING = {
    "tilt_rad": ("pressing_m_s2", "pulling_m_s2", "gravity"),
    "down_rad": ("down", "tilt_axis", "gravity"),
    "way_rad": ("way",),
    "point_m": ("centre_m",),
}
"""The properties that are worked out from each field."""


def _other(one: T, **changed: Array | float) -> T:
    """Returns a copy with some fields `changed`, without what follows from them.

    All else that was worked out stays known.
    """
    other: T = object.__new__(type(one))
    known = vars(other)
    known.update(vars(one), **changed)
    for name in changed:
        for following in FOLLOWING.get(name, ()):
            known.pop(following, None)
    return other


def middle(point_m: Array) -> Array:
    """Returns the means (n, 2), m, of the points `point_m` (n, k, 2), m.

    NumPy's own takes six times as long for so few.
    """
    return np.einsum("nki->ni", point_m) / point_m.shape[1]


def unit(angle_rad: Array) -> Array:
    """Returns unit vectors (n, 2) of the angles `angle_rad` (n,), rad."""
    return columns(np.cos(angle_rad), np.sin(angle_rad))
