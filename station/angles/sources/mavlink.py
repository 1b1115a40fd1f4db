"""Any autopilot that speaks MAVLink (the paper's Pixhawk): roll and pitch of its ATTITUDE messages, by pymavlink.

`port` is `udp:HOST:PORT` (an address of this machine on which to listen) or a serial port. The autopilot is asked for
ATTITUDE at `rate_hz` (SET_MESSAGE_INTERVAL) as long as it sends fewer; 0 leaves its streams as they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import common

from shared.byte_links import ByteLink, open_link
from shared.config import parse
from station.angles.frames import gravity_of_aeronautical, mount_rotation, on_plate
from station.angles.reading import Reading, Vector, reading_of_gravity
from station.angles.sources import SourceLink

ON_DEMAND = False
_HEARTBEAT_NS = 1_000_000_000
_GROUND_STATION = 255
_MISSION_PLANNER = 190  # the component number that ground stations use
_ENOUGH = 0.8


@dataclass(frozen=True, kw_only=True)
class MavlinkOptions:
    """`system_id` picks one of several autopilots on a link (0: whichever speaks).

    `mount_rpy_deg` turns the autopilot on the plate; at zero its nose points along the plate's x, its back is up.
    """

    port: str = "udp:127.0.0.1:14550"
    baud: int = 115200
    rate_hz: float = 50.0
    system_id: int = 0
    mount_rpy_deg: Vector = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if not 0 <= self.rate_hz <= 1000 or not 0 <= self.system_id <= 255:
            raise ValueError(f"expected a rate_hz of 0 to 1000 and a system_id of 0 to 255, got {self}")


class MavlinkSource:
    """An `AngleSource` that is a small ground station."""

    def __init__(self, link: SourceLink) -> None:
        self._options = parse(MavlinkOptions, link.options)
        self._plate_from_sensor = mount_rotation(self._options.mount_rpy_deg)
        self._clock, self._complain = link.clock, link.complain
        self._bytes: ByteLink | None = None
        self._mav: Any = None
        self._beat_ns = 0
        self._heard = 0
        self._vehicle: tuple[int, int] | None = None

    def open(self) -> None:
        """Opens the link to the autopilot and begins to parse anew."""
        self.close()
        self._bytes = open_link(self._options.port, baud=self._options.baud)
        self._mav = common.MAVLink(self._bytes, srcSystem=_GROUND_STATION, srcComponent=_MISSION_PLANNER)
        self._mav.robust_parsing = True
        self._beat_ns, self._vehicle = 0, None

    def read(self) -> tuple[Reading, ...]:
        """Returns a reading for each attitude that has arrived, and tells the autopilot that we listen."""
        if self._bytes is None:
            return ()
        now_ns = self._clock.now_ns()
        data = self._bytes.read()
        messages: Sequence[Any] = (self._mav.parse_buffer(data) or ()) if data else ()
        attitudes = [message for message in messages if self._is_attitude(message)]
        self._heard += len(attitudes)
        self._beat(now_ns)
        return tuple(self._reading(message, attitudes[-1], now_ns) for message in attitudes)

    def _is_attitude(self, message: Any) -> bool:
        kind: str = message.get_type()
        if kind == "BAD_DATA":
            self._complain(f"{len(message.data)} bytes are not MAVLink ({message.reason})")
            return False
        system: int = message.get_srcSystem()
        if self._options.system_id not in (0, system):
            return False
        if kind == "HEARTBEAT" and message.type != common.MAV_TYPE_GCS:
            self._vehicle = (system, message.get_srcComponent())
        return kind == "ATTITUDE"

    def _reading(self, message: Any, newest: Any, now_ns: int) -> Reading:
        """Gives one reading; what came in one batch is put apart by the autopilot's own clock, the newest being now."""
        earlier_ms = newest.time_boot_ms - message.time_boot_ms
        stamp_ns = now_ns - (earlier_ms * 1_000_000 if 0 <= earlier_ms < 1000 else 0)
        gravity = gravity_of_aeronautical(message.roll, message.pitch)
        return reading_of_gravity(on_plate(gravity, plate_from_sensor=self._plate_from_sensor), stamp_ns=stamp_ns)

    def _beat(self, now_ns: int) -> None:
        """Says once a second that we are here, and asks for more if too little comes."""
        if now_ns - self._beat_ns < _HEARTBEAT_NS:
            return
        enough = self._heard >= _ENOUGH * self._options.rate_hz and self._beat_ns > 0
        self._beat_ns, self._heard = now_ns, 0
        self._mav.heartbeat_send(common.MAV_TYPE_GCS, common.MAV_AUTOPILOT_INVALID, 0, 0, 0)
        if self._vehicle is not None and self._options.rate_hz > 0 and not enough:
            interval_us = 1e6 / self._options.rate_hz
            wanted = (common.MAV_CMD_SET_MESSAGE_INTERVAL, 0, common.MAVLINK_MSG_ID_ATTITUDE, interval_us)
            self._mav.command_long_send(*self._vehicle, *wanted, 0, 0, 0, 0, 0)

    def close(self) -> None:
        """Closes the link, if it is open."""
        if self._bytes is not None:
            self._bytes.close()
            self._bytes = None


def connect(link: SourceLink) -> MavlinkSource:
    """Returns the source for a table of rig.toml."""
    return MavlinkSource(link)
