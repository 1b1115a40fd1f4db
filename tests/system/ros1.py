"""A real roscore and a robot on it, on free ports of 127.0.0.1; each ended by its own pid.

ROS 1 is not part of this program's environment. Where it is missing, its tests are skipped with the reason, unless
they were asked for by name.
"""

from __future__ import annotations

import contextlib
import importlib.util
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Generator
from functools import cache
from xmlrpc.client import ServerProxy

import pytest

from tests.patience import PATIENCE_S
from tests.system.ports import free_port

PACKAGES = "python3-roslaunch python3-rospy python3-actionlib python3-trajectory-msgs python3-sensor-msgs"
_PATH = "/usr/lib/python3/dist-packages"


def missing() -> str:
    """Names what of ROS 1 is not installed; nothing when all is."""
    if shutil.which("roscore") is None:
        return "roscore"
    found = {
        name: importlib.util.find_spec(name) or os.path.isdir(f"{_PATH}/{name}")
        for name in ("rospy", "actionlib", "trajectory_msgs", "sensor_msgs")
    }
    return ", ".join(name for name, there in found.items() if not there)


def require_ros1(config: pytest.Config) -> None:
    """Skip when ROS 1 is missing, fail when the test was asked for by name."""
    if lack := missing():
        reason = f"ROS 1 is not installed (no {lack}): apt install {PACKAGES}"
        if any("ros1" in str(argument) for argument in config.invocation_params.args):
            pytest.fail(reason)
        pytest.skip(reason)


@contextlib.contextmanager
def process(arguments: list[str], environment: dict[str, str]) -> Generator[subprocess.Popen[bytes]]:
    """A child process that is ended by its own pid."""
    child = subprocess.Popen(
        arguments, env={**os.environ, **environment}, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        yield child
    finally:
        child.terminate()
        try:
            child.wait(timeout=5)
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait()


def ros_environment(uri: str) -> dict[str, str]:
    """The variables by which ROS programs find the master on this machine only."""
    return {"ROS_MASTER_URI": uri, "ROS_IP": "127.0.0.1", "ROS_HOSTNAME": "127.0.0.1"}


@cache
def roscore() -> str:
    """The address of a roscore that lives as long as this process: ROS lets a process join only one."""
    port = free_port()
    uri = f"http://127.0.0.1:{port}"
    keeper = contextlib.ExitStack()
    keeper.enter_context(process(["roscore", "-p", str(port)], ros_environment(uri)))
    _KEEPERS.append(keeper)
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        with contextlib.suppress(OSError), ServerProxy(uri) as master:
            if "/rosout" in str(master.getSystemState("/test")):
                return uri
        time.sleep(0.1)
    keeper.close()
    raise AssertionError(f"roscore did not start within {PATIENCE_S:g} s")


_KEEPERS: list[contextlib.ExitStack] = []


def stop_roscore() -> None:
    """End the roscore, if one was started."""
    while _KEEPERS:
        _KEEPERS.pop().close()
    roscore.cache_clear()


@contextlib.contextmanager
def ros_arm(model: str, *, mode: str = "obey") -> Generator[subprocess.Popen[bytes]]:
    """A robot on the roscore, in its own process."""
    arguments = [sys.executable, "-m", "tests.system.ros1_arm", model, mode]
    with process(arguments, ros_environment(roscore())) as child:
        yield child
