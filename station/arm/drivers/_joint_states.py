"""Joint states of ROS, in which other publishers of the same topic (a gripper, a lift) may report their joints, too."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shared.errors import UserError
from station.arm.drivers import JointReading, match_joints
from station.arm.drivers._robot_clock import Arrivals, RobotClock
from station.rig.arm_model import ArmModel

Array = NDArray[np.float64]
_BASE_NS = 50_000_000
"""The time over which speeds are derived: an encoder of 0.02 degrees then shows 0.4 degrees/s, which is still rest."""


class JointStates:
    """Makes an arm's readings of the joint states on its topic; those of other joints are none, and change nothing."""

    def __init__(self, model: ArmModel) -> None:
        self._model = model
        self._arrivals = Arrivals()
        self._clock = RobotClock()
        self.reading: JointReading | None = None
        """The latest one, in the model's order; None before the first."""
        self._foreign = ""
        self._places: deque[tuple[int, Array]] = deque()
        """The latest stamps, ns, with the joints' angles then: as many as speeds are derived from."""

    def tick(self, now_ns: int) -> None:
        """Takes in the agent's time, by which readings are stamped; before the first tick there are none."""
        self._arrivals.tick(now_ns)

    def take(
        self,
        names: Sequence[str],
        position_rad: ArrayLike,
        *,
        velocity_rad_s: ArrayLike = (),
        effort_nm: ArrayLike = (),
        robot_ns: int,
        noted_ns: int,
    ) -> None:
        """Takes a state of k joints, which are found by their names every time.

        Args:
            names: (k,) the joints that it reports, in any order.
            position_rad: (k,) their angles, rad; without them it is no reading.
            velocity_rad_s: (k,) their velocities, rad/s; where the robot sends none, they are derived from its angles,
                and a state before that is possible is no reading.
            effort_nm: (k,) their efforts, N m; where the robot sends none, they are zero.
            robot_ns: its stamp, ns of the robot's clock; 0 where there is none.
            noted_ns: its arrival, as `Arrivals.now` noted it.
        """
        try:
            order = match_joints(self._model, tuple(names))
            position = _angles(position_rad, joints=len(names))[order]
        except UserError as foreign:
            self._foreign = str(foreign)
            return
        stamp_ns = self._clock.stamp_ns(robot_ns, arrived_ns=noted_ns) + self._arrivals.ahead_ns()
        velocity, effort = _sent(velocity_rad_s, order), _sent(effort_nm, order)
        if velocity is None and (velocity := self._derived(position, stamp_ns)) is None:
            return
        effort = np.zeros(len(order)) if effort is None else effort
        self.reading = JointReading(stamp_ns, self._model.joint_names, position, velocity, effort)

    def _derived(self, position: Array, stamp_ns: int) -> Array | None:
        """Returns the velocities (n,), rad/s, over the last `_BASE_NS`; None while no angles are so old.

        Unknown speeds are not zero: by them an arm that moves would rest.
        """
        places = self._places
        places.append((stamp_ns, position))
        while len(places) > 1 and stamp_ns - places[1][0] >= _BASE_NS:
            places.popleft()
        began_ns, began = places[0]
        lasted_ns = stamp_ns - began_ns
        return (position - began) / (lasted_ns * 1e-9) if lasted_ns >= _BASE_NS else None

    def robot_ns(self, now_ns: int) -> int | None:
        """Returns the time that the robot's clock shows at a time of the agent's, ns; None while it stamps nothing.

        It is early by the least transport delay, by which readings are late.
        """
        offset_ns = self._clock.offset_ns()
        return None if offset_ns is None else now_ns - self._arrivals.ahead_ns() - offset_ns

    def fault(self) -> str:
        """Returns why no state so far was the arm's, in one sentence; nothing once one was, as silence is told then."""
        return self._foreign if self.reading is None else ""


def _angles(position_rad: ArrayLike, *, joints: int) -> Array:
    position = np.array(position_rad, dtype=np.float64)
    if position.shape != (joints,):
        raise UserError(f"Expected an angle for each of the {joints} joints that the arm reports, got {position.size}.")
    return position


def _sent(values: ArrayLike, order: list[int]) -> Array | None:
    sent = np.array(values, dtype=np.float64)
    return sent[order] if len(sent) > max(order) else None
