"""The ros2 driver on a Zenoh router of our own: what is missing is named, and the robot's own joint order is kept."""

from __future__ import annotations

import importlib
import threading
import time
from collections.abc import Generator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

from shared.clock import SystemClock
from shared.config import Table
from shared.errors import UserError
from shared.memory_bus import MemoryBus
from shared.zenoh_bus import RawSession
from station.arm.drivers import Driver, DriverLink, _ros2_wire, load_driver
from station.arm.tilt_path import TiltStage
from station.arm.trajectory import JointTrajectory
from station.rig.arm_model import ArmModel
from tests.contracts.ros2_robot import TRAJECTORY, Ros2Robot
from tests.patience import PATIENCE_S
from tests.system.ros1 import free_port
from tests.unit.arm.test_stopping import tilting


def connect(model: ArmModel, endpoint: str, *, timeout_s: float = 0.5, bus: MemoryBus | None = None) -> Driver:
    options = Table({"router": endpoint, "domain": 7, "answer_timeout_s": timeout_s})
    return load_driver("ros2", link=DriverLink(bus=bus or MemoryBus(SystemClock()), model=model, options=options))


@contextmanager
def router() -> Generator[str]:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    session = RawSession(listen=[endpoint], mode="router")
    try:
        yield endpoint
    finally:
        session.close()


def until_named(driver: Driver, robot: Ros2Robot) -> None:
    for _ in range(500):
        robot.step(time.time_ns())
        driver.tick(time.time_ns())
        if driver.fault() or driver.read() is not None:
            return
        time.sleep(0.01)
    raise AssertionError("the driver heard nothing")


def test_a_missing_router_is_named(model: ArmModel) -> None:
    with pytest.raises(UserError, match=r"Expected a Zenoh router at tcp/127\.0\.0\.1"):
        connect(model, f"tcp/127.0.0.1:{free_port()}")


def test_a_missing_controller_is_named(model: ArmModel) -> None:
    with router() as endpoint, pytest.raises(UserError, match="listens to /joint_trajectory_controller"):
        connect(model, endpoint)


def test_a_controller_that_shows_up_late_is_waited_for(model: ArmModel) -> None:
    with router() as endpoint:
        robots = list[Ros2Robot]()
        late = threading.Timer(1.0, lambda: robots.append(Ros2Robot(model, endpoint=endpoint)))
        late.start()
        driver = connect(model, endpoint, timeout_s=PATIENCE_S)
        late.join()
        driver.close()
        for robot in robots:
            robot.close()


def test_a_controller_of_another_ros_is_named(model: ArmModel) -> None:
    with router() as endpoint:
        other = RawSession(connect=[endpoint])
        token = _ros2_wire.subscriber_token(
            other.id, domain=7, node="controller", entity=1, topic=TRAJECTORY, type_name=_ros2_wire.JOINT_TRAJECTORY
        )
        other.announce(token.replace(_ros2_wire.type_hash(_ros2_wire.JOINT_TRAJECTORY), "TypeHashNotSupported"))
        time.sleep(0.3)
        try:
            with pytest.raises(UserError, match="another version"):
                connect(model, endpoint)
        finally:
            other.close()


def test_foreign_joints_are_named_and_own_ones_put_in_order(model: ArmModel) -> None:
    with router() as endpoint:
        robot = Ros2Robot(model, endpoint=endpoint)
        for names, fault in ((robot.names, ""), (["elbow"] * 7, "elbow")):
            robot.names = names
            driver = connect(model, endpoint)
            try:
                until_named(driver, robot)
                assert fault in driver.fault()
                if reading := driver.read():
                    np.testing.assert_allclose(reading.position_rad, model.home_rad, atol=1e-9)
                else:
                    assert fault
            finally:
                driver.close()
        robot.close()


@pytest.mark.parametrize("joints", [2, 7])
def test_a_gripper_on_the_same_topic_is_no_reading(model: ArmModel, joints: int) -> None:
    with router() as endpoint:
        robot = Ros2Robot(model, endpoint=endpoint)
        bus = MemoryBus(SystemClock())
        driver = connect(model, endpoint, bus=bus)
        try:
            until_named(driver, robot)
            robot.say([f"finger_{i}" for i in range(joints)], np.full(joints, 0.02), now_ns=time.time_ns())
            robot.session.put(robot.key, JUNK)  # it comes behind the gripper's state, on the same key
            for _ in range(500):
                driver.tick(time.time_ns())
                if bus.malformed:
                    break
                time.sleep(0.01)
            assert bus.malformed == {"/joint_states": 1}
            reading = driver.read()
            assert reading is not None
            np.testing.assert_array_equal(reading.position_rad, model.home_rad)
            assert driver.fault() == ""
        finally:
            driver.close()
            robot.close()


@pytest.mark.parametrize("ahead_s", [0.09, -0.09, -1e9])
def test_readings_are_stamped_by_the_agents_clock(model: ArmModel, ahead_s: float) -> None:
    with router() as endpoint:
        robot = Ros2Robot(model, endpoint=endpoint)
        robot.ahead_ns = round(ahead_s * 1e9)
        clock = SystemClock()
        driver = connect(model, endpoint)
        try:
            before_ns = clock.now_ns()
            until_named(driver, robot)
            reading = driver.read()
            assert reading is not None
            assert before_ns <= reading.stamp_ns <= clock.now_ns()
        finally:
            driver.close()
            robot.close()


@pytest.fixture(scope="module")
def long_tilt(stage: TiltStage) -> JointTrajectory:
    return tilting(stage, rate_deg_s=5.0, angle_deg=40.0)


@contextmanager
def moving(model: ArmModel, motion: JointTrajectory, *, ahead_ns: int = 0) -> Generator[tuple[Ros2Robot, Driver]]:
    """A robot on its way, whose clock is ahead of ours."""
    with router() as endpoint:
        robot = Ros2Robot(model, endpoint=endpoint)
        robot.ahead_ns = ahead_ns
        driver = connect(model, endpoint)
        try:
            until_named(driver, robot)
            driver.start(motion, now_ns=time.time_ns())
            for _ in range(150):
                driver.tick(time.time_ns())
                robot.step(time.time_ns())
                time.sleep(0.01)
            assert np.abs(robot.position - motion.position_rad[0]).max() > 0.02
            yield robot, driver
        finally:
            driver.close()
            robot.close()


def step_until_rest(robot: Ros2Robot) -> np.ndarray:
    """Let the robot move until it rests, silently, and give all of its positions, (k, 6)."""
    trail = [robot.position]
    robot.report = lambda now_ns: None  # noqa: ARG005
    while len(trail) < 30 or np.ptp(trail[-30:], axis=0).max() > 0:
        robot.step(time.time_ns())
        trail.append(robot.position)
        time.sleep(0.01)
    return np.array(trail)


def test_an_arm_whose_agent_dies_comes_to_rest(model: ArmModel, long_tilt: JointTrajectory) -> None:
    with moving(model, long_tilt) as (robot, _):
        trail = step_until_rest(robot)
    at = np.abs(long_tilt.position_rad[-1] - trail).max(axis=1)
    assert at[-1] > 0.1
    assert at[0] - at[-1] < 0.2


def test_a_halt_without_joint_states_never_moves_back(model: ArmModel, long_tilt: JointTrajectory) -> None:
    with moving(model, long_tilt) as (robot, driver):
        driver.halt(now_ns=time.time_ns())
        trail = step_until_rest(robot)
    way = long_tilt.position_rad[-1] - long_tilt.position_rad[0]
    assert np.diff(trail @ way).min() >= -1e-4  # the robot of this test plays its points linearly
    assert np.abs(long_tilt.position_rad[-1] - trail[-1]).max() > 0.1


def test_a_halt_goes_nowhere_near_an_old_reading(model: ArmModel, long_tilt: JointTrajectory) -> None:
    with moving(model, long_tilt) as (robot, driver):
        for _ in range(30):  # the joint states stay away while the arm moves on
            robot.report = lambda now_ns: None  # noqa: ARG005
            driver.tick(time.time_ns())
            robot.step(time.time_ns())
            time.sleep(0.01)
        driver.halt(now_ns=time.time_ns())
        trail = step_until_rest(robot)
    way = long_tilt.position_rad[-1] - long_tilt.position_rad[0]
    assert np.diff(trail @ way).min() >= -1e-4


@pytest.mark.parametrize("ahead_s", [0.0, 90.0, -1e9])
def test_horizons_are_stamped_by_the_robots_clock(model: ArmModel, long_tilt: JointTrajectory, ahead_s: float) -> None:
    ahead_ns = round(ahead_s * 1e9)
    began_ns = time.time_ns()
    with moving(model, long_tilt, ahead_ns=ahead_ns) as (robot, _):
        heard = [_ros2_wire.decode(payload, _ros2_wire.JOINT_TRAJECTORY) for payload, _ in robot.received]
    assert len(heard) > 3
    for message in heard:
        stamp_ns = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
        assert began_ns + ahead_ns - 10**9 < stamp_ns < time.time_ns() + ahead_ns
        assert not np.any(message.points[-1].velocities)


JUNK = b"\x00\x01\x00\x00\xff\xff\xff\xff"
"""Eight bytes, as of another program's type on the key of the joint states."""
DEFINITIONS = {
    "builtin_interfaces/msg/Time": "int32 sec\nuint32 nanosec\n",
    "builtin_interfaces/msg/Duration": "int32 sec\nuint32 nanosec\n",
    "std_msgs/msg/Header": "builtin_interfaces/Time stamp\nstring frame_id\n",
    "trajectory_msgs/msg/JointTrajectoryPoint": (
        "float64[] positions\nfloat64[] velocities\nfloat64[] accelerations\nfloat64[] effort\n"
        "builtin_interfaces/Duration time_from_start\n"
    ),
    _ros2_wire.JOINT_TRAJECTORY: (
        "std_msgs/Header header\nstring[] joint_names\ntrajectory_msgs/JointTrajectoryPoint[] points\n"
    ),
    _ros2_wire.JOINT_STATE: (
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n"
    ),
}


@contextmanager
def sdk_robot(endpoint: str) -> Generator[tuple[Any, Any, list[Any]]]:
    """A robot made of somebody else's rmw_zenoh implementation: its types, its publisher, and what it has heard."""
    sdk: Any = pytest.importorskip(
        "zenoh_ros2_sdk",
        reason="the independent rmw_zenoh implementation is not installed: pip install zenoh-ros2-sdk",
    )
    session_class: Any = importlib.import_module("zenoh_ros2_sdk.session").ZenohSession
    where = {"domain_id": 7, "router_ip": "127.0.0.1", "router_port": int(endpoint.rsplit(":", 1)[1])}
    session = session_class.get_instance(where["router_ip"], where["router_port"])
    for name, definition in DEFINITIONS.items():
        session.register_message_type(definition, name)
    heard: list[Any] = []
    trajectory, state = _ros2_wire.JOINT_TRAJECTORY, _ros2_wire.JOINT_STATE
    subscriber = sdk.ROS2Subscriber(
        TRAJECTORY,
        trajectory,
        callback=heard.append,
        msg_definition=DEFINITIONS[trajectory],
        type_hash=_ros2_wire.PUBLISHED_HASHES[trajectory],
        **where,
    )
    publisher = sdk.ROS2Publisher(
        "/joint_states",
        state,
        msg_definition=DEFINITIONS[state],
        type_hash=_ros2_wire.PUBLISHED_HASHES[state],
        **where,
    )
    try:
        yield session.store.types, publisher, heard
    finally:
        subscriber.close()
        publisher.close()
        session.session.close()


def test_another_implementation_of_rmw_zenoh_and_the_driver_hear_each_other(model: ArmModel) -> None:
    with router() as endpoint, sdk_robot(endpoint) as (types, publisher, heard):
        time.sleep(0.3)
        driver = connect(model, endpoint)
        began_ns = time.time_ns()
        home = np.array(model.home_rad)
        driver.start(
            JointTrajectory(
                times_ns=np.array([0, 1_500_000_000]),
                position_rad=np.array([home, home + 0.01]),
                velocity_rad_s=np.zeros((2, 6)),
            ),
            now_ns=time.time_ns(),
        )
        stamp = types["builtin_interfaces/msg/Time"](sec=5, nanosec=6)
        header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="")
        for _ in range(300):
            nothing = np.zeros(6)
            publisher.publish(
                header=header, name=list(model.joint_names), position=home, velocity=nothing, effort=nothing
            )
            driver.tick(time.time_ns())
            if heard and driver.read() and np.array_equal(heard[-1].points[-1].positions, home + 0.01):
                break
            time.sleep(0.01)
        reading = driver.read()
        driver.close()
    assert reading is not None
    assert began_ns <= reading.stamp_ns <= time.time_ns()
    np.testing.assert_array_equal(reading.position_rad, home)
    assert tuple(heard[0].joint_names) == model.joint_names
    np.testing.assert_allclose(heard[0].points[0].positions, home)
    np.testing.assert_array_equal(heard[-1].points[-1].positions, home + 0.01)
    seconds = [point.time_from_start.sec + point.time_from_start.nanosec * 1e-9 for point in heard[0].points]
    assert seconds[0] == 0.0
    assert seconds == sorted(seconds)
    assert 1.4 < seconds[-1] < 2.6  # half a second, the way to rest, and a second's hold
