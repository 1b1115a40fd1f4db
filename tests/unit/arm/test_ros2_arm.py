"""The ros2 driver on a Zenoh router of our own: what is missing is named, and the robot's own joint order is kept."""

from __future__ import annotations

import time
from collections.abc import Generator
from contextlib import contextmanager

import numpy as np
import pytest

from shared.clock import SystemClock
from shared.config import Table
from shared.errors import UserError
from shared.memory_bus import MemoryBus
from shared.zenoh_bus import RawSession
from station.arm.drivers import Driver, DriverLink, _ros2_wire, load_driver
from station.rig.arm_model import ArmModel
from tests.contracts.ros2_robot import TRAJECTORY, Ros2Robot
from tests.system.ros1 import free_port


def connect(model: ArmModel, endpoint: str) -> Driver:
    options = Table({"router": endpoint, "domain": 7, "answer_timeout_s": 0.5})
    return load_driver("ros2", link=DriverLink(bus=MemoryBus(SystemClock()), model=model, options=options))


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
