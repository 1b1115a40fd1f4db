"""Angle sensors that are not there: each speaks its real protocol on loopback, to the tilt that a test tells it."""

from __future__ import annotations

import contextlib
import math
import socket
import struct
import threading
import time
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from pymavlink.dialects.v20 import common

from shared.bus import Bus
from shared.geometry import quaternion_from_matrix
from shared.messages import PlatformState, RunEvent, TwinScene
from station.rig.tilt import tilt_rotation
from tests.pseudo_terminal import Pty

Options = dict[str, object]


class Emulator(Protocol):
    """A sensor on a plate."""

    axes: int
    """3: knows gravity's direction; 1: the tilt about its own axis alone."""
    tolerance_rad: float

    def options(self) -> Options:
        """The sensor's table in rig.toml."""
        ...

    def say(self, angle_rad: float, *, azimuth_rad: float = 0.0) -> None:
        """One reading of a plate that is tilted so."""
        ...

    def serve(self) -> None:
        """Answer what the client has asked; called often."""
        ...

    def babble(self) -> None:
        """Something that is no reading."""
        ...

    def close(self) -> None:
        """Gone."""
        ...


@contextmanager
def serving(end: Emulator) -> Generator[None]:
    """Lets an emulator answer while the source opens."""
    stop = threading.Event()

    def serve() -> None:
        while not stop.is_set():
            end.serve()
            stop.wait(0.005)

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


def free_udp_port() -> int:
    """A port that nobody uses now."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def roll_pitch_of(angle_rad: float, azimuth_rad: float) -> tuple[float, float]:
    """MAVLink's roll and pitch of a tilted plate, by turning the rotation into forward-right-down axes."""
    flip = np.diag([1.0, -1.0, -1.0])
    rotation = flip @ tilt_rotation(angle_rad, azimuth_rad=azimuth_rad) @ flip
    return math.atan2(rotation[2, 1], rotation[2, 2]), -math.asin(float(np.clip(rotation[2, 0], -1, 1)))


class _Wire:
    """The wire that pymavlink writes to."""

    def __init__(self) -> None:
        self.sent: list[bytes] = []

    def write(self, data: bytes) -> None:
        self.sent.append(bytes(data))


class Pixhawk:
    """An autopilot: heartbeat and ATTITUDE over UDP, or over a pty; streams nothing until it is asked, if `shy`."""

    axes = 3
    tolerance_rad = 1e-6

    def __init__(self, *, serial: bool = False, shy: bool = False) -> None:
        self._port = free_udp_port()
        self._pty = Pty() if serial else None
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._wire = _Wire()
        self._mav: Any = common.MAVLink(self._wire, srcSystem=1, srcComponent=1)
        self._ear: Any = common.MAVLink(None)
        self._ear.robust_parsing = True
        self._boot = time.monotonic()
        self._shy = shy
        self.asked_hz: list[float] = []
        self.ground_stations = 0

    def options(self) -> Options:
        if self._pty:
            return {"port": self._pty.name, "baud": 57600}
        return {"port": f"udp:127.0.0.1:{self._port}"}

    def _flush(self) -> None:
        data, self._wire.sent = b"".join(self._wire.sent), []
        self._send(data)

    def _send(self, data: bytes) -> None:
        if self._pty:
            self._pty.write(data)
        else:
            with contextlib.suppress(ConnectionRefusedError, BlockingIOError):
                self._socket.sendto(data, ("127.0.0.1", self._port))

    def heartbeat(self) -> None:
        self._mav.heartbeat_send(common.MAV_TYPE_QUADROTOR, common.MAV_AUTOPILOT_PX4, 0, 0, 0)
        self._flush()

    def say(self, angle_rad: float, *, azimuth_rad: float = 0.0) -> None:
        if self._shy and not self.asked_hz:
            return
        roll, pitch = roll_pitch_of(angle_rad, azimuth_rad)
        boot_ms = round((time.monotonic() - self._boot) * 1000)
        self._mav.attitude_send(boot_ms, roll, pitch, 0.3, 0.0, 0.0, 0.0)
        self._flush()

    def serve(self) -> None:
        data = b""
        if self._pty:
            data = self._pty.read()
        else:
            with contextlib.suppress(BlockingIOError, ConnectionRefusedError):
                data = self._socket.recv(65536)
        for message in (self._ear.parse_buffer(data) or ()) if data else ():
            if message.get_type() == "HEARTBEAT" and message.type == common.MAV_TYPE_GCS:
                self.ground_stations += 1
            elif message.get_type() == "COMMAND_LONG" and message.command == common.MAV_CMD_SET_MESSAGE_INTERVAL:
                assert int(message.param1) == common.MAVLINK_MSG_ID_ATTITUDE
                assert message.target_system == 1
                self.asked_hz.append(1e6 / message.param2)

    def babble(self) -> None:
        self._mav.attitude_send(0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0)
        frame = bytearray(b"".join(self._wire.sent))
        self._wire.sent = []
        frame[12] ^= 0xFF  # the checksum no longer fits
        self._send(b"\x00\x01\x02" + bytes(frame))

    def close(self) -> None:
        self._socket.close()
        if self._pty:
            self._pty.close()


# Our axes to Motive's with y up: x, z, −y.
_MOTIVE_FROM_OURS = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


class Motive:
    """A NatNet 3.1 server with one rigid body, in unicast."""

    axes = 3
    tolerance_rad = 1e-6

    def __init__(self, *, up_axis: str = "y", rigid_body: int = 7, mute: bool = False) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.setblocking(False)
        self._client: tuple[str, int] | None = None
        self._frame = 0
        self._up_axis, self._body, self._mute = up_axis, rigid_body, mute
        self._start = time.monotonic()

    def options(self) -> Options:
        port: int = self._socket.getsockname()[1]
        return {"command_port": port, "data_port": free_udp_port(), "up_axis": self._up_axis, "timeout_s": 2.0}

    def serve(self) -> None:
        with contextlib.suppress(BlockingIOError, ConnectionRefusedError):
            while True:
                data, client = self._socket.recvfrom(65536)
                if struct.unpack_from("<H", data)[0] == 0 and not self._mute:  # NAT_CONNECT
                    self._client = client
                    self._send(1, b"Motive".ljust(256, b"\0") + bytes((3, 0, 0, 0)) + bytes((3, 1, 0, 0)))

    def _send(self, kind: int, payload: bytes) -> None:
        if self._client is not None:
            with contextlib.suppress(ConnectionRefusedError, BlockingIOError):
                self._socket.sendto(struct.pack("<HH", kind, len(payload)) + payload, self._client)

    def say(self, angle_rad: float, *, azimuth_rad: float = 0.0, seen: bool = True) -> None:
        rotation = tilt_rotation(angle_rad, azimuth_rad=azimuth_rad)
        if self._up_axis == "y":
            rotation = _MOTIVE_FROM_OURS @ rotation @ _MOTIVE_FROM_OURS.T
        qw, qx, qy, qz = quaternion_from_matrix(rotation)
        self._frame += 1
        body = struct.pack("<I3f4ffH", self._body, 0.1, 1.2, 0.3, qx, qy, qz, qw, 0.0002, int(seen))
        seconds = time.monotonic() - self._start
        suffix = struct.pack("<IIdQQQH", 0, 0, seconds, 1, 2, 3, 0)
        # Frame number; marker sets, unlabelled markers; rigid bodies; skeletons, labelled markers, plates, devices.
        self._send(7, struct.pack("<IIII", self._frame, 0, 0, 1) + body + struct.pack("<4I", 0, 0, 0, 0) + suffix)

    def babble(self) -> None:
        self._send(7, struct.pack("<IIII", 1, 0, 0, 5) + b"\0" * 7)

    def close(self) -> None:
        self._socket.close()


class SerialInclinometer:
    """A digital inclinometer with one axis that sends a line a reading."""

    axes = 1
    tolerance_rad = math.radians(0.0006)

    def __init__(self) -> None:
        self.cable = Pty()

    def options(self) -> Options:
        return {"port": self.cable.name, "baud": 9600}

    def say(self, angle_rad: float, *, azimuth_rad: float = 0.0) -> None:
        del azimuth_rad
        self.cable.write(f"{math.degrees(angle_rad):+08.3f}\r\n".encode())

    def serve(self) -> None:
        self.cable.read()

    def babble(self) -> None:
        self.cable.write(b"\xff\xfeERR over\x80load\r\n")

    def close(self) -> None:
        self.cable.close()


class ArmOnBus:
    """The arm agent's `arm/platform`, for the source `kinematics`."""

    axes = 3
    tolerance_rad = 1e-9

    def __init__(self, bus: Bus) -> None:
        self._bus = bus

    def options(self) -> Options:
        return {}

    def say(self, angle_rad: float, *, azimuth_rad: float = 0.0) -> None:
        rotation = tilt_rotation(angle_rad, azimuth_rad=azimuth_rad)
        self._bus.publish("arm/platform", PlatformState(1, *quaternion_from_matrix(rotation)))

    def serve(self) -> None:
        return

    def babble(self) -> None:
        return

    def close(self) -> None:
        return


class TwinOnBus(ArmOnBus):
    """The twin's truth, for the source `simulated`."""

    def options(self) -> Options:
        return {"rate_hz": 1e9}

    def say(self, angle_rad: float, *, azimuth_rad: float = 0.0) -> None:
        rotation = tilt_rotation(angle_rad, azimuth_rad=azimuth_rad)
        self._bus.publish("truth/scene", TwinScene(1, *quaternion_from_matrix(rotation)))


class GaugeReader:
    """A person with a gauge, who has written the values down: for the source `typed`."""

    axes = 1
    tolerance_rad = 1e-9

    def __init__(self, bus: Bus, *, folder: Path, angles_rad: tuple[float, ...]) -> None:
        self._bus, self._stops = bus, 0
        self._file = folder / "gauge.txt"
        lines = "\n".join(f"{math.degrees(angle)!r}" for angle in angles_rad)
        self._file.write_text(f"# Capri 20005\n{lines}\n", encoding="utf-8")

    def options(self) -> Options:
        return {"file": str(self._file)}

    def say(self, angle_rad: float, *, azimuth_rad: float = 0.0) -> None:
        """The next stop; the value is in the file."""
        del angle_rad, azimuth_rad
        self._stops += 1
        self._bus.publish("session/event", RunEvent(1, 1, "DWELL", "", self._stops))

    def serve(self) -> None:
        return

    def babble(self) -> None:
        return

    def close(self) -> None:
        return
