"""OptiTrack motion capture: a rigid body on the plate, from Motive's NatNet stream by the `natnet` client library.

Make the rigid body in Motive while the plate is level and its x along Motive's x (or say how it is turned by
`mount_rpy_deg`). In unicast the library binds its data socket to every address of this machine, at a port of the
system's choice; NatNet itself has no authentication.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Any, Literal

from natnet import NatNetClient, NatNetError

from shared.config import parse
from shared.errors import UserError
from station.angles.frames import gravity_of_motive, mount_rotation, on_plate
from station.angles.reading import Reading, Vector, reading_of_gravity
from station.angles.sources import SourceLink

ON_DEMAND = False
_GARBAGE = (struct.error, UnicodeDecodeError, IndexError, MemoryError, TypeError)
_MOST_BAD = 100


@dataclass(frozen=True, kw_only=True)
class NatnetOptions:
    """`server` is Motive's machine, `local` this one's address; the ports are Motive's defaults.

    `rigid_body` is the streaming ID (0: the only one). `latency_ms` is the time from exposure to arrival, which
    Motive shows; it is subtracted from the stamps.
    """

    server: str = "127.0.0.1"
    local: str = "127.0.0.1"
    command_port: int = 1510
    data_port: int = 1511
    multicast: bool = False
    multicast_address: str = "239.255.42.99"
    rigid_body: int = 0
    up_axis: Literal["y", "z"] = "y"
    latency_ms: float = 0.0
    timeout_s: float = 2.0
    mount_rpy_deg: Vector = (0.0, 0.0, 0.0)


class NatnetSource:
    """An `AngleSource` over a NatNet client that is driven by `read`."""

    def __init__(self, link: SourceLink) -> None:
        self._options = parse(NatnetOptions, link.options)
        self._plate_from_sensor = mount_rotation(self._options.mount_rpy_deg)
        self._clock, self._complain = link.clock, link.complain
        self._client: Any = None
        self._frames: list[Any] = []

    def open(self) -> None:
        """Connects to Motive's NatNet server.

        Raises:
            UserError: if Motive does not answer.
        """
        self.close()
        given = self._options
        client: Any = NatNetClient(
            server_ip_address=given.server,
            local_ip_address=given.local,
            multicast_address=given.multicast_address,
            command_port=given.command_port,
            data_port=given.data_port,
            use_multicast=given.multicast,
        )
        client.on_data_frame_received_event.handlers.append(self._frames.append)
        try:
            client.connect(timeout=given.timeout_s)
        except (TimeoutError, OSError, NatNetError, *_GARBAGE) as error:
            client.shutdown()
            raise UserError(
                f"Expected Motive's NatNet server at {given.server}:{given.command_port}, but got "
                f"{error or 'no answer'}: switch streaming on in Motive, and check both addresses and the firewall"
            ) from error
        self._client = client

    def read(self) -> tuple[Reading, ...]:
        """Returns a reading for each frame that has arrived and in which the rigid body was seen."""
        if self._client is None:
            return ()
        self._take_in()
        now_ns = self._clock.now_ns()
        frames, self._frames[:] = list(self._frames), []
        readings = (self._reading(frame, frames[-1], now_ns) for frame in frames)
        return tuple(reading for reading in readings if reading is not None)

    def _take_in(self) -> None:
        """Lets the client parse what has arrived; a packet that breaks its parser is one reading lost, not all."""
        for _ in range(_MOST_BAD):
            try:
                self._client.update_sync()
            except _GARBAGE as error:
                self._complain(f"a packet is not NatNet ({error})")
            else:
                return

    def _reading(self, frame: Any, newest: Any, now_ns: int) -> Reading | None:
        body = self._body(frame)
        if body is None:
            return None
        earlier_s: float = newest.suffix.timestamp - frame.suffix.timestamp
        delay_s = self._options.latency_ms * 1e-3 + (earlier_s if 0 <= earlier_s < 1 else 0.0)
        gravity = gravity_of_motive(*body.rot, up_axis=self._options.up_axis)
        turned = on_plate(gravity, plate_from_sensor=self._plate_from_sensor)
        return reading_of_gravity(turned, stamp_ns=now_ns - round(delay_s * 1e9))

    def _body(self, frame: Any) -> Any:
        """Returns the rigid body in a frame, None (with a complaint) when it is not there or was not seen."""
        bodies = [body for body in frame.rigid_bodies if self._options.rigid_body in (0, body.id_num)]
        if len(bodies) != 1:
            seen = ", ".join(str(body.id_num) for body in frame.rigid_bodies) or "none"
            wanted = self._options.rigid_body or "exactly one"
            self._complain(f"expected the rigid body {wanted}, but Motive streams {seen}: set rigid_body in its table")
            return None
        if bodies[0].tracking_valid is False or not any(bodies[0].rot):
            self._complain("Motive does not see the rigid body: are its markers covered?")
            return None
        return bodies[0]

    def close(self) -> None:
        """Ends the client, if there is one, and drops the frames that were not read."""
        if self._client is not None:
            self._client.shutdown()
            self._client = None
        self._frames.clear()


def connect(link: SourceLink) -> NatnetSource:
    """Returns the source for a table of rig.toml."""
    return NatnetSource(link)
