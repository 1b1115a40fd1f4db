"""Compares a recording's attitudes of the plate with those that its joints give, by the arm's kinematics run again."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from shared.geometry import Array
from shared.messages import JointState, PlatformState
from station.arm.kinematics import pivot_jacobian
from station.recording.reader import RecordingReader
from station.rig.placed_arm import PlacedArm

NUMBERS = ("qw", "qx", "qy", "qz", "wx", "wy", "wz", "px", "py", "pz")
SAME = 1e-9
"""Numbers of the same joints agree within this (parts of a quaternion, rad/s, m): processors agree so far, and it moves
no corner by a hundred-thousandth of a pixel (`pytest -s tests/unit/app/test_verify_attitudes.py` prints 7e-15)."""
AT_ONCE = 4096
"""Attitudes that are derived together."""
WAITING = 6000
"""Messages that wait for those of the same reading: a minute of them at 100 Hz."""

Pair = tuple[JointState, PlatformState]


@dataclass(frozen=True, slots=True)
class OtherAttitude:
    """A number of an attitude that its joints do not give: which, as recorded and as derived."""

    stamp_ns: int
    name: str
    recorded: float
    derived: float


@dataclass
class AttitudesAgain:
    """The numbers of attitudes and of those whose joints were recorded, the largest difference, and the first."""

    attitudes: int = 0
    compared: int = 0
    worst: float = 0.0
    different: int = 0
    first: OtherAttitude | None = None

    def take(self, pairs: Sequence[Pair], arm: PlacedArm) -> None:
        """Compares the attitudes of some readings with what their joints give."""
        recorded = np.array([[getattr(state, name) for name in NUMBERS] for _, state in pairs])
        derived = numbers_of(arm, *joints_of(arm, [joints for joints, _ in pairs]))
        # A quaternion and its negative are the same turn.
        sign = np.where(np.sum(recorded[:, :4] * derived[:, :4], axis=1) < 0, -1.0, 1.0)
        derived[:, :4] *= sign[:, None]
        away = np.abs(recorded - derived)
        other = ~(away <= SAME)
        self.compared += len(pairs)
        self.worst = max(self.worst, float(away.max()))
        self.different += int(other.any(axis=1).sum())
        if self.first is None and other.any():
            row, column = (int(one[0]) for one in np.nonzero(other))
            numbers = float(recorded[row, column]), float(derived[row, column])
            self.first = OtherAttitude(pairs[row][1].stamp_ns, NUMBERS[column], *numbers)


def attitudes_again(reader: RecordingReader, arm: PlacedArm) -> AttitudesAgain:
    """Derives every recorded attitude of the plate again from the joints of the same moment."""
    found, waiting = AttitudesAgain(), list[Pair]()
    for pair in _pairs(reader, frozenset(arm.model.joint_names), found):
        waiting.append(pair)
        if len(waiting) == AT_ONCE:
            found.take(waiting, arm)
            waiting.clear()
    if waiting:
        found.take(waiting, arm)
    return found


def joints_of(arm: PlacedArm, states: Sequence[JointState]) -> tuple[Array, Array]:
    """Returns the angles (n, joints), rad, and rates (n, joints), rad/s, in the order of the arm's model."""
    names = arm.model.joint_names

    def ordered(state: JointState, values: Sequence[float]) -> list[float]:
        by_name = dict(zip(state.name, values, strict=False))
        return [by_name.get(name, 0.0) for name in names]

    return (
        np.array([ordered(state, state.position_rad) for state in states]),
        np.array([ordered(state, state.velocity_rad_s) for state in states]),
    )


def numbers_of(arm: PlacedArm, position_rad: Array, rate_rad_s: Array) -> Array:
    """Returns the numbers (n, 10) of `PlatformState`.

    They are those of joint angles `position_rad` (n, joints) and of their rates `rate_rad_s` (n, joints). The angular
    velocity is the sum of rate times axis over the joints, in the plate's frame.
    """
    pose, jacobian = pivot_jacobian(arm.model, position_rad)
    turn = arm.world_from_base[:3, :3] @ pose[:, :3, :3]
    place = pose[:, :3, 3] @ arm.world_from_base[:3, :3].T + arm.world_from_base[:3, 3]
    in_base = np.einsum("nij,nj->ni", jacobian[:, 3:], rate_rad_s)
    quaternion = Rotation.from_matrix(turn).as_quat(scalar_first=True)
    return np.hstack([quaternion, np.einsum("nji,nj->ni", pose[:, :3, :3], in_base), place])


def _pairs(reader: RecordingReader, names: frozenset[str], found: AttitudesAgain) -> Iterator[Pair]:
    """Yields joints and attitude of one reading, which have the same stamp, and counts the attitudes."""
    joints, states = OrderedDict[int, JointState](), OrderedDict[int, PlatformState]()
    for item in reader.messages({"arm/joints", "arm/platform"}):
        message = item.message
        if isinstance(message, JointState) and names <= set(message.name):
            joints[message.stamp_ns] = message
        elif isinstance(message, PlatformState):
            states[message.stamp_ns] = message
            found.attitudes += 1
        else:
            continue
        if message.stamp_ns in joints and message.stamp_ns in states:
            yield joints.pop(message.stamp_ns), states.pop(message.stamp_ns)
        for waiting in (joints, states):
            if len(waiting) > WAITING:
                waiting.popitem(last=False)
