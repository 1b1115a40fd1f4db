"""A serial inclinometer (pyserial): one reading a line of text.

The default line is a number in degrees, with or without a label before it and a unit behind it: `+012.34`,
`X=1.25 deg`, `$INC,-0.50*5F`. Anything else in the line makes it unreadable. `pattern` is a regular expression for the
whole line that says otherwise: its group `angle` is the tilt of a sensor with one axis; its groups `x` and `y` are
those of a sensor with two (how far its x and y axes point above the horizon).
With `checksum = "nmea"` only lines are taken that end in `*HH`, the XOR of the characters between `$` and `*`.
A sensor that must be asked gets `request` `request_hz` times a second.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import reduce
from typing import Literal

from shared.byte_links import ByteLink, open_link
from shared.config import parse
from station.angles.frames import mount_rotation, on_plate
from station.angles.reading import Reading, Vector, reading_of_gravity
from station.angles.sources import SourceLink

ON_DEMAND = False
NUMBER = r"[-+]?\d+(?:\.\d+)?"
LINE = rf"\s*(?:\$?[A-Za-z]+\s*[=:,]\s*)?(?P<angle>{NUMBER})\s*(?:deg|\u00b0|\u00c2\u00b0)?\s*"
"""The default `pattern`; the degree sign comes in Latin-1 or in UTF-8, and either is read as Latin-1."""
_LONGEST = 1024
_SHOWN = 40
_FULL_TURN = 2 * math.pi + 1e-6


@dataclass(frozen=True, kw_only=True)
class InclinometerOptions:
    """`unit` is that of the numbers; `sign` −1 for a sensor that counts the other way; `offset_deg` is subtracted.

    `mount_rpy_deg` is for sensors with two axes.
    """

    port: str
    baud: int = 9600
    pattern: str = LINE
    unit: Literal["deg", "rad", "mm/m"] = "deg"
    sign: Literal[1, -1] = 1
    offset_deg: float = 0.0
    checksum: Literal["none", "nmea"] = "none"
    request: str = ""
    request_hz: float = 10.0
    mount_rpy_deg: Vector = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        try:
            groups = set(re.compile(self.pattern).groupindex)
        except re.error as error:
            raise ValueError(f"expected a regular expression for 'pattern', got {self.pattern!r} ({error})") from error
        if groups not in ({"angle"}, {"x", "y"}):
            raise ValueError(f"expected 'pattern' with the group (?P<angle>…), or (?P<x>…) and (?P<y>…), got {groups}")
        if not self.request_hz > 0:
            raise ValueError(f"expected a positive number for 'request_hz', got {self.request_hz}")


class InclinometerSource:
    """An `AngleSource` that reads lines."""

    def __init__(self, link: SourceLink) -> None:
        self._options = parse(InclinometerOptions, link.options)
        self._pattern = re.compile(self._options.pattern)
        self._plate_from_sensor = mount_rotation(self._options.mount_rpy_deg)
        self._clock, self._complain = link.clock, link.complain
        self._bytes: ByteLink | None = None
        self._rest = b""
        self._whole = False
        self._asked_ns = 0

    def open(self) -> None:
        """Opens the link to the sensor, and forgets what was read before."""
        self.close()
        self._bytes = open_link(self._options.port, baud=self._options.baud)
        self._rest, self._whole, self._asked_ns = b"", False, 0

    def read(self) -> tuple[Reading, ...]:
        """Returns a reading for each whole line that has arrived, after asking for more if the sensor wants that."""
        if self._bytes is None:
            return ()
        now_ns = self._clock.now_ns()
        self._ask(now_ns)
        *lines, self._rest = re.split(rb"[\r\n]+", self._rest + self._bytes.read())
        if len(self._rest) > _LONGEST:
            self._complain(f"no end of a line in {len(self._rest)} bytes: is the baud rate right?")
            self._rest, self._whole = b"", False
        if lines and not self._whole:
            # The port was opened in the middle of a line: "+12.5" may have arrived as "2.5".
            lines, self._whole = lines[1:], True
        readings = (self._reading(line, now_ns) for line in lines if line.strip())
        return tuple(reading for reading in readings if reading is not None)

    def _ask(self, now_ns: int) -> None:
        if self._options.request and self._bytes and now_ns - self._asked_ns >= 1e9 / self._options.request_hz:
            self._asked_ns, self._whole = now_ns, True  # one that waits to be asked sends nothing by halves
            self._bytes.write(self._options.request.encode())

    def _reading(self, line: bytes, stamp_ns: int) -> Reading | None:
        text = line.decode("latin-1").strip()
        payload = text if self._options.checksum == "none" else _checked(text)
        found = self._pattern.fullmatch(payload) if payload is not None else None
        values = {name: self._radians(value) for name, value in found.groupdict().items()} if found else {}
        if not values or not all(abs(value) <= _FULL_TURN for value in values.values()):
            self._complain(f"the line {text[:_SHOWN]!a} holds no angle")
            return None
        if "angle" in values:
            # A sensor that counts from 0 to 360 degrees says 359.9 for -0.1.
            return Reading(stamp_ns=stamp_ns, angle_rad=math.remainder(values["angle"], 2 * math.pi))
        return self._of_two_axes(values["x"], values["y"], stamp_ns)

    def _of_two_axes(self, x_rad: float, y_rad: float, stamp_ns: int) -> Reading | None:
        gx, gy = -math.sin(x_rad), -math.sin(y_rad)
        if gx * gx + gy * gy > 1.0:
            self._complain(f"the axes cannot point {math.degrees(x_rad):.1f} and {math.degrees(y_rad):.1f} degrees up")
            return None
        gravity = (gx, gy, -math.sqrt(1.0 - gx * gx - gy * gy))
        return reading_of_gravity(on_plate(gravity, plate_from_sensor=self._plate_from_sensor), stamp_ns=stamp_ns)

    def _radians(self, text: str | None) -> float:
        try:
            value = float(text or "nan")
        except ValueError:
            return math.nan
        unit = self._options.unit
        angle = math.radians(value) if unit == "deg" else value if unit == "rad" else math.atan(value * 1e-3)
        return self._options.sign * angle - math.radians(self._options.offset_deg)

    def close(self) -> None:
        """Closes the link, if it is open."""
        if self._bytes is not None:
            self._bytes.close()
            self._bytes = None


def nmea_checksum(payload: str) -> int:
    """Returns the XOR of the characters, as NMEA 0183 has it."""
    return reduce(lambda total, character: total ^ ord(character), payload, 0)


def _checked(line: str) -> str | None:
    """Returns the text between `$` and `*` if the two hexadecimal digits behind it agree, else nothing."""
    found = re.fullmatch(r".*?\$?([^$*]*)\*([0-9A-Fa-f]{2})", line)
    if found is None or nmea_checksum(found.group(1)) != int(found.group(2), 16):
        return None
    return found.group(1)


def connect(link: SourceLink) -> InclinometerSource:
    """Returns the source for a table of rig.toml."""
    return InclinometerSource(link)
