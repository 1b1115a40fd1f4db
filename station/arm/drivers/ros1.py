"""Arms under ROS 1 with a FollowJointTrajectory action: Kinova's JACO with kinova-ros, as in the paper, and others.

A motion is one goal; a halt cancels it. ROS runs in a process of its own (`_ros1_bridge`), under its own Python.
Tested against a real ROS 1 master with an action server that speaks the published protocol; not tried on a real arm.

`[arm.options]`: `master_uri` and `address` (this machine's address as the robot sees it; both default to ROS's own
environment variables, then to this machine), `action` and `joint_states` (kinova-ros's names by default), `python` and
`ros_path` (the Python that has ROS, and where; Debian's by default), `answer_timeout_s`, `connect_timeout_s`.

The robot's clock may show any time (`_robot_clock`).
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
import subprocess
import threading
from collections import deque
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any
from xmlrpc.client import ServerProxy

from shared.config import parse
from shared.errors import UserError
from station.arm.drivers import DriverLink, JointReading
from station.arm.drivers._joint_states import JointStates
from station.arm.drivers._robot_clock import Arrivals
from station.arm.trajectory import JointTrajectory

_BRIDGE = Path(__file__).with_name("_ros1_bridge.py")
_CODES = {
    0: "it gave no reason",
    -1: "the goal is invalid",
    -2: "the joint names are not the robot's",
    -3: "the goal's time stamp is in the past",
    -4: "the arm left the path's tolerance",
    -5: "the arm did not reach the goal's tolerance",
}
_REFUSED = {"REJECTED": "rejected the motion", "ABORTED": "aborted the motion", "LOST": "lost the motion"}


@dataclass(frozen=True, kw_only=True)
class Ros1Options:
    """The `[arm.options]` table for this driver."""

    master_uri: str = ""
    address: str = ""
    action: str = ""
    joint_states: str = ""
    python: str = "/usr/bin/python3"
    ros_path: str = "/usr/lib/python3/dist-packages"
    answer_timeout_s: float = 2.0
    connect_timeout_s: float = 5.0


class Ros1Arm:
    """A `Driver` over ROS 1; `tick` takes in what the bridge has said."""

    def __init__(self, link: DriverLink) -> None:
        self._model = link.model
        self._options = _completed(parse(Ros1Options, link.options), robot=link.model.name)
        self._bus = link.bus
        self._said: deque[tuple[int, str]] = deque(maxlen=1000)
        """The bridge's lines that wait for a tick, each behind its moment of arrival."""
        self._heard = threading.Event()
        self._states = JointStates(link.model)
        self._goal = 0
        self._asked_ns: int | None = None
        self._unanswered = ""
        self._now_ns = 0
        self._fault = ""
        _require_master(self._options.master_uri)
        self._bridge = _start_bridge(self._options)
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()
        self._await_robot()

    def _listen(self) -> None:
        """Reads the bridge on a thread of its own; it only enqueues."""
        assert self._bridge.stdout is not None
        for line in self._bridge.stdout:
            self._said.append((Arrivals.now(), line))
            self._heard.set()
        self._said.append((Arrivals.now(), json.dumps({"error": "its ROS process has ended"})))
        self._heard.set()

    def _await_robot(self) -> None:
        """Waits for `ready`; raises UserError with the bridge's reason, or when none comes."""
        answer: dict[str, Any] = {}
        while not answer and self._heard.wait(self._options.connect_timeout_s + 5.0):
            self._heard.clear()
            with contextlib.suppress(IndexError):
                while not answer:
                    line = self._parsed(self._said.popleft()[1])
                    answer = {} if "state" in line else line  # states go on coming, and the time is not known yet
        if "ready" not in answer:
            self.close()
            raise UserError(
                f"The arm cannot be reached over ROS at {self._options.master_uri}: "
                f"{answer.get('error', 'its ROS process gave no answer')}. Start the robot's driver, or correct "
                "[arm.options] in rig.toml."
            )

    def _send(self, **order: Any) -> None:
        assert self._bridge.stdin is not None
        try:
            self._bridge.stdin.write(json.dumps(order) + "\n")
            self._bridge.stdin.flush()
        except (OSError, ValueError):
            self._fault = "the arm's ROS process has ended: restart the arm agent"

    def start(self, trajectory: JointTrajectory, *, now_ns: int) -> None:
        """Sends a new goal, which replaces the one under way."""
        self._fault, self._asked_ns = "", now_ns
        self._unanswered = f"the robot's driver did not answer within {self._options.answer_timeout_s:.1f} s"
        self._goal += 1
        self._send(
            goal=self._goal,
            names=list(self._model.joint_names),
            times_ns=trajectory.times_ns.tolist(),
            positions=trajectory.position_rad.tolist(),
            velocities=trajectory.velocity_rad_s.tolist(),
        )

    def halt(self, *, now_ns: int) -> None:
        """Cancels every goal, also those of an earlier life of this program."""
        self._now_ns = max(self._now_ns, now_ns)
        self._goal += 1  # later news of the halted goal are of no interest
        self._asked_ns = None
        self._send(cancel=True)

    def tick(self, now_ns: int) -> None:
        """Takes in what the bridge has said; a goal without an answer in time becomes a fault."""
        self._now_ns = now_ns
        self._states.tick(now_ns)
        with contextlib.suppress(IndexError):
            while True:
                noted_ns, line = self._said.popleft()
                self._take(self._parsed(line), noted_ns=noted_ns)
        if self._asked_ns is not None and now_ns - self._asked_ns > self._options.answer_timeout_s * 1e9:
            self._fault, self._asked_ns = self._unanswered, None

    def _parsed(self, line: str) -> dict[str, Any]:
        """Returns what a line says; one that says nothing is counted and logged as any payload that is no message."""
        try:
            return dict(json.loads(line))
        except (TypeError, ValueError) as wrong:
            self._bus.leave_out(self._options.joint_states, UserError(f"Expected a line of the ROS process: {wrong}"))
            return {}

    def _take(self, line: dict[str, Any], *, noted_ns: int) -> None:
        if "state" in line:
            robot_ns, names, position, velocity, effort = line["state"]
            self._states.take(
                names, position, velocity_rad_s=velocity, effort_nm=effort, robot_ns=robot_ns, noted_ns=noted_ns
            )
        elif "goal" in line and line["goal"] == self._goal:
            self._take_status(line)
        elif "error" in line:
            self._fault = f"the arm is lost: {line['error']}"

    def _take_status(self, line: dict[str, Any]) -> None:
        if line["status"] in _REFUSED:
            why = line["text"] or _CODES.get(line["code"], f"error {line['code']}")
            refused = f"the robot's driver {_REFUSED[line['status']]}: {why}"
            if line["done"]:
                self._fault, self._asked_ns = refused, None
            else:  # the reason comes with the result, on a topic of its own, a little later
                self._unanswered, self._asked_ns = refused, self._now_ns
        elif line["status"] != "PENDING":  # ROS itself says that much, before the robot has seen the goal
            self._asked_ns = None

    def read(self) -> JointReading | None:
        """Returns the latest joint state in the model's order; None before the first."""
        return self._states.reading

    def fault(self) -> str:
        """Returns what is wrong with the goal, the joints or the bridge in one sentence; nothing while all is well."""
        return self._fault or self._states.fault()

    def close(self) -> None:
        """Ends the bridge, which first cancels what moves."""
        assert self._bridge.stdin is not None
        assert self._bridge.stdout is not None
        with contextlib.suppress(OSError):
            self._bridge.stdin.close()
        try:
            self._bridge.wait(timeout=3.0)
        except subprocess.TimeoutExpired:
            self._bridge.kill()
            self._bridge.wait()
        self._listener.join(timeout=1.0)
        self._bridge.stdout.close()


def _completed(options: Ros1Options, *, robot: str) -> Ros1Options:
    """Returns the options with kinova-ros's names and ROS's environment where nothing was given."""
    values = asdict(options)
    values["master_uri"] = options.master_uri or os.environ.get("ROS_MASTER_URI") or "http://127.0.0.1:11311"
    values["address"] = options.address or os.environ.get("ROS_IP") or "127.0.0.1"
    values["action"] = options.action or f"/{robot}/follow_joint_trajectory"
    values["joint_states"] = options.joint_states or f"/{robot}_driver/out/joint_state"
    return Ros1Options(**values)


def _start_bridge(options: Ros1Options) -> subprocess.Popen[str]:
    environment = {**os.environ, "ROS_MASTER_URI": options.master_uri, "ROS_IP": options.address}
    environment.pop("ROS_HOSTNAME", None)  # it would go before ROS_IP
    try:
        return subprocess.Popen(
            [options.python, str(_BRIDGE), json.dumps(asdict(options))],
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            start_new_session=True,  # Ctrl-C is for the agent, which then ends the bridge in order
        )
    except OSError as error:
        raise UserError(
            f"The ros1 driver needs a Python with ROS 1, but {options.python} cannot be run ({error.strerror}): on "
            "Debian 12, apt install python3-rospy python3-actionlib; else set 'python' in [arm.options] of rig.toml."
        ) from None


def _require_master(uri: str) -> None:
    """Asks the ROS master for a sign of life; without this, ROS waits for it for ever."""
    before = socket.getdefaulttimeout()
    socket.setdefaulttimeout(2.0)
    try:
        with ServerProxy(uri) as master:
            master.getPid("/repose_arm")
    except OSError as error:
        raise UserError(
            f"No ROS master answers at {uri} ({error}): start roscore and the robot's driver, or correct 'master_uri' "
            "in [arm.options] of rig.toml."
        ) from None
    finally:
        socket.setdefaulttimeout(before)


def connect(link: DriverLink) -> Ros1Arm:
    """Connects to the robot's ROS master."""
    return Ros1Arm(link)
