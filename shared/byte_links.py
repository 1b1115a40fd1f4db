"""Byte links to devices: a serial port (pyserial) or a UDP socket. The only module that knows pyserial."""

from __future__ import annotations

import contextlib
import socket
from typing import Protocol

import serial

from shared.errors import UserError

_MOST = 65536


class ByteLink(Protocol):
    """Bytes to and from a device; faults are OSErrors."""

    def read(self) -> bytes:
        """Returns the bytes that have arrived; none when nothing has."""
        ...

    def write(self, data: bytes) -> None:
        """Sends."""
        ...

    def close(self) -> None:
        """Lets go of the link."""
        ...


class UdpLink:
    """A UDP socket bound to one address; it answers to whoever spoke last."""

    def __init__(self, host: str, port: int) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._peer: tuple[str, int] | None = None
        try:
            self._socket.bind((host, port))
        except OSError:
            self._socket.close()
            raise
        self._socket.setblocking(False)

    def read(self) -> bytes:
        """Returns all datagrams that wait, joined; nothing if there are none."""
        parts: list[bytes] = []
        with contextlib.suppress(BlockingIOError):
            while sum(map(len, parts)) < _MOST:
                data, self._peer = self._socket.recvfrom(_MOST)
                parts.append(data)
        return b"".join(parts)

    def write(self, data: bytes) -> None:
        """Sends a datagram to whoever spoke last; nothing is sent before somebody has spoken."""
        if self._peer is not None:
            with contextlib.suppress(BlockingIOError, ConnectionRefusedError):
                self._socket.sendto(data, self._peer)

    def close(self) -> None:
        """Closes the socket."""
        self._socket.close()


class SerialLink:
    """A serial port, or any of pyserial's URLs (such as rfc2217://host:port for a port on the network)."""

    def __init__(self, port: str, *, baud: int) -> None:
        self._serial = serial.serial_for_url(port, baudrate=baud, timeout=0, write_timeout=0.5)

    def read(self) -> bytes:
        """Returns the bytes that the port has received, without waiting for more."""
        data: bytes = self._serial.read(min(max(self._serial.in_waiting, 1), _MOST))
        return data

    def write(self, data: bytes) -> None:
        """Sends the bytes; raises an OSError if the port does not take them within half a second."""
        self._serial.write(data)

    def close(self) -> None:
        """Closes the port."""
        self._serial.close()


def open_link(port: str, *, baud: int) -> ByteLink:
    """Opens `udp:HOST:PORT` (bound to that address of this machine) or a serial port.

    Raises:
        UserError: if it cannot be opened.
    """
    if not port.startswith("udp:"):
        try:
            return SerialLink(port, baud=baud)
        except (OSError, ValueError) as error:
            raise UserError(
                f"Expected a serial port at {port}, but it cannot be opened ({error}): check the cable, the name and "
                "the right to use it (group dialout)"
            ) from error
    host, _, number = port.removeprefix("udp:").rpartition(":")
    if not host or not number.isdigit():
        raise UserError(
            f"Expected udp:HOST:PORT with an address of this machine, such as udp:127.0.0.1:14550, got {port}"
        )
    try:
        return UdpLink(host, int(number))
    except (OSError, OverflowError) as error:
        raise UserError(
            f"Expected to listen on {port}, but it cannot be bound ({error}): is another program listening there?"
        ) from error
