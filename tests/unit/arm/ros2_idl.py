"""ROS 2's messages as pycdr2 has them: an implementation of CDR that is not ours (it resolves no postponed types)."""

from dataclasses import dataclass

from pycdr2 import IdlStruct  # pyright: ignore[reportMissingImports]
from pycdr2.types import float64, int32, sequence, uint32  # pyright: ignore[reportMissingImports]


@dataclass
class Time(IdlStruct, typename="builtin_interfaces/Time"):
    sec: int32
    nanosec: uint32


@dataclass
class Duration(IdlStruct, typename="builtin_interfaces/Duration"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs/Header"):
    stamp: Time
    frame_id: str


@dataclass
class JointTrajectoryPoint(IdlStruct, typename="trajectory_msgs/JointTrajectoryPoint"):
    positions: sequence[float64]
    velocities: sequence[float64]
    accelerations: sequence[float64]
    effort: sequence[float64]
    time_from_start: Duration


@dataclass
class JointTrajectory(IdlStruct, typename="trajectory_msgs/JointTrajectory"):
    header: Header
    joint_names: sequence[str]
    points: sequence[JointTrajectoryPoint]
