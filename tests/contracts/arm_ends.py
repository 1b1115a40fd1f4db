"""The other end of each arm driver: an arm that obeys, in simulated or in real time."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Generator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from importlib import import_module
from unittest.mock import patch

import numpy as np
import pytest
from numpy.typing import NDArray

from shared.bus import Received
from shared.clock import SimulatedClock, SystemClock
from shared.config import Table
from shared.memory_bus import MemoryBus
from shared.messages import JointState, JointTarget
from shared.zenoh_bus import RawSession
from station.arm.drivers import Driver, DriverLink, _horizons, load_driver
from station.arm.tilt_path import TiltStage
from tests.contracts.ros2_robot import Ros2Robot
from tests.patience import PATIENCE_S
from tests.system.ros1 import free_port, require_ros1, ros_arm, roscore

Array = NDArray[np.float64]
TICK_NS = 10_000_000
BUSY_NS = 5_000_000_000
"""A busy machine may keep this process from running for longer than an arm bears (0.5 s), which then rightly brakes."""


@dataclass(frozen=True, kw_only=True)
class End:
    """A driver and its arm: `advance` lets one tick pass at both ends, `arm_rad` is where the arm really is."""

    driver: Driver
    link: DriverLink
    now_ns: Callable[[], int]
    advance: Callable[[], None]
    arm_rad: Callable[[], Array]

    def until(self, reached: Callable[[], bool], *, ticks: int = 1000) -> None:
        """Let time pass until something is so; fails after `ticks`."""
        for _ in range(ticks):
            if reached():
                return
            self.advance()
        raise AssertionError(f"not reached within {ticks} ticks")


@contextmanager
def simulated(stage: TiltStage) -> Generator[End]:
    """The twin: an arm that takes every set-point of the bus."""
    clock = SimulatedClock()
    bus = MemoryBus(clock)
    link = DriverLink(bus=bus, model=stage.model)
    driver = load_driver("simulated", link=link)
    arm = [stage.home_rad.copy()]

    def follow(received: Received) -> None:
        assert isinstance(received.message, JointTarget)
        arm[0] = np.array(received.message.position_rad)

    def advance() -> None:
        clock.advance_to(clock.now_ns() + TICK_NS)
        state = JointState(clock.now_ns(), stage.model.joint_names, tuple(arm[0].tolist()), (0.0,) * 6, ())
        bus.publish("twin/joints", state)
        driver.tick(clock.now_ns())

    bus.subscribe("twin/target", follow)
    yield End(driver=driver, link=link, now_ns=clock.now_ns, advance=advance, arm_rad=lambda: arm[0])
    driver.close()


@contextmanager
def ros1(stage: TiltStage) -> Generator[End]:
    """A robot in a process of its own on a real ROS master, in real time."""
    clock = SystemClock()
    with ros_arm("jaco2_spherical"):
        options = Table({"master_uri": roscore(), "connect_timeout_s": PATIENCE_S})
        link = DriverLink(bus=MemoryBus(clock), model=stage.model, options=options)
        driver = load_driver("ros1", link=link)

        def advance() -> None:
            time.sleep(TICK_NS * 1e-9)
            driver.tick(clock.now_ns())

        def where() -> Array:
            reading = driver.read()
            return stage.home_rad if reading is None else reading.position_rad

        try:
            yield End(driver=driver, link=link, now_ns=clock.now_ns, advance=advance, arm_rad=where)
        finally:
            driver.close()


@contextmanager
def ros2(stage: TiltStage) -> Generator[End]:
    """A joint_trajectory_controller on a Zenoh router: all in this process, in real time."""
    clock = SystemClock()
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    router = RawSession(listen=[endpoint], mode="router")
    arm = Ros2Robot(stage.model, endpoint=endpoint)
    link = DriverLink(bus=MemoryBus(clock), model=stage.model, options=Table({"router": endpoint, "domain": 7}))
    driver = load_driver("ros2", link=link)

    def advance() -> None:
        time.sleep(TICK_NS * 1e-9)
        arm.step(clock.now_ns())
        driver.tick(clock.now_ns())

    try:
        with patch.object(_horizons, "HORIZON_NS", BUSY_NS):
            yield End(
                driver=driver,
                link=link,
                now_ns=clock.now_ns,
                advance=advance,
                arm_rad=lambda: np.asarray(arm.position[:6], dtype=np.float64),
            )
    finally:
        driver.close()
        arm.close()
        router.close()


@contextmanager
def servo(stage: TiltStage) -> Generator[End]:
    """The emulated tilt stage, with as many axes as the arm has, on a pty in simulated time."""
    emulated = import_module("tests.tilt_stage.emulated")  # a pty, which only some systems have
    unit = math.pi / 180 / emulated.PER_DEGREE
    home = [round(angle / unit) for angle in stage.home_rad]
    arm = emulated.EmulatedStage(axes=len(home), limit=1000 * emulated.PER_DEGREE, us_per_90=0, placed=True, at=home)
    clock = SimulatedClock()
    began_ns = clock.now_ns()
    with emulated.opened(arm) as pty:
        options = Table({"port": pty.port})
        link = DriverLink(bus=MemoryBus(clock), model=stage.model, options=options)
        with emulated.answering(pty):
            driver = load_driver("servo", link=link)

        def advance() -> None:
            clock.advance_to(clock.now_ns() + TICK_NS)
            pty.serve((clock.now_ns() - began_ns) // 1_000_000)
            time.sleep(0.001)  # the kernel hands the bytes on
            driver.tick(clock.now_ns())

        try:
            yield End(
                driver=driver, link=link, now_ns=clock.now_ns, advance=advance, arm_rad=lambda: unit * np.array(arm.at)
            )
        finally:
            driver.close()


def require_pty(config: pytest.Config) -> None:
    """Skips where there are no pseudo-terminals."""
    del config
    pytest.importorskip("tty", reason="the emulated stage is on a pty, which Windows does not have")


ENDS: dict[str, Callable[[TiltStage], AbstractContextManager[End]]] = {
    "simulated": simulated,
    "servo": servo,
    "ros1": ros1,
    "ros2": ros2,
}
NEEDS: dict[str, Callable[[pytest.Config], None]] = {"ros1": require_ros1, "servo": require_pty}
