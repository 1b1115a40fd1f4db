"""A sensor on the twin's plate: the true tilt from `truth/scene`, made worse in known ways.

It says

    y = alpha + offset + (gain − 1) alpha + u hysteresis / 2 + noise,    rounded to `resolution`,

with alpha the true tilt and u = +1 after the tilt has grown, −1 after it has shrunk. So what a comparison finds can
be held against what was planted. It exists only beside the twin; no analysis reads the truth.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from shared.bus import Received
from shared.config import parse
from shared.geometry import downhill_of, tilt_of
from shared.messages import TwinScene
from station.angles.reading import Reading, reading_of_gravity
from station.angles.sources import SourceLink
from station.rig.tilt import gravity_in_plate

ON_DEMAND = False
_KEPT = 10_000
_TURNED_RAD = math.radians(0.02)
_LEVEL_RAD = math.radians(0.05)


@dataclass(frozen=True, kw_only=True)
class SimulatedOptions:
    """`axes` 3 knows gravity's direction, 1 only the tilt. `azimuth_deg` is where its errors point when level."""

    offset_deg: float = 0.0
    gain: float = 1.0
    hysteresis_deg: float = 0.0
    noise_deg: float = 0.0
    resolution_deg: float = 0.0
    rate_hz: float = 100.0
    axes: int = 3
    azimuth_deg: float = 0.0
    seed: int = 1

    def __post_init__(self) -> None:
        if not self.rate_hz > 0 or self.noise_deg < 0 or self.resolution_deg < 0 or self.axes not in (1, 3):
            raise ValueError(
                "expected a positive rate_hz, noise_deg and resolution_deg of 0 or more, and axes 1 or 3, got "
                f"{self.rate_hz}, {self.noise_deg}, {self.resolution_deg} and {self.axes}"
            )


class SimulatedSource:
    """An `AngleSource` beside the twin."""

    def __init__(self, link: SourceLink) -> None:
        self._options = parse(SimulatedOptions, link.options)
        self._rng = np.random.default_rng([self._options.seed, *link.name.encode()])
        self._waiting: deque[Reading] = deque(maxlen=_KEPT)
        self._due_ns = 0
        self._approach = 0
        self._turning_rad: float | None = None
        self._azimuth_rad = math.radians(self._options.azimuth_deg)
        link.bus.subscribe("truth/scene", self._receive)

    def _receive(self, received: Received) -> None:
        scene, now_ns = received.message, received.receive_ns
        if not isinstance(scene, TwinScene):
            return
        attitude = (scene.qw, scene.qx, scene.qy, scene.qz)
        tilt = tilt_of(*attitude)
        if tilt > _LEVEL_RAD:
            x, y = downhill_of(*attitude)
            self._azimuth_rad = math.atan2(x, -y)  # downhill is (sin beta, -cos beta)
        self._follow(tilt)
        if now_ns >= self._due_ns:
            period_ns = round(1e9 / self._options.rate_hz)
            self._due_ns = max(self._due_ns + period_ns, now_ns + period_ns // 2)
            self._waiting.append(self._reading(tilt, now_ns))

    def _follow(self, tilt_rad: float) -> None:
        """Follows from which side the plate comes: it has turned once it left its turning point by more than noise."""
        if self._turning_rad is None:
            self._turning_rad = tilt_rad
        moved = tilt_rad - self._turning_rad
        if self._approach * moved > 0:
            self._turning_rad = tilt_rad
        elif abs(moved) > _TURNED_RAD:
            self._approach, self._turning_rad = (1 if moved > 0 else -1), tilt_rad

    def _reading(self, tilt_rad: float, stamp_ns: int) -> Reading:
        given = self._options
        error_deg = given.offset_deg + self._approach * given.hysteresis_deg / 2
        error_deg += given.noise_deg * self._rng.standard_normal()
        angle = given.gain * tilt_rad + math.radians(error_deg)
        if given.resolution_deg > 0:
            step = math.radians(given.resolution_deg)
            angle = round(angle / step) * step
        if given.axes == 1:
            return Reading(stamp_ns=stamp_ns, angle_rad=angle)
        x, y, z = gravity_in_plate(angle, azimuth_rad=self._azimuth_rad, gravity_m_s2=1.0).tolist()
        return reading_of_gravity((x, y, z), stamp_ns=stamp_ns)

    def open(self) -> None:
        """Does nothing: the bus is open already."""

    def read(self) -> tuple[Reading, ...]:
        """Returns the simulated readings since the last call."""
        return tuple(self._waiting.popleft() for _ in range(len(self._waiting)))

    def close(self) -> None:
        """Does nothing: the bus belongs to the station."""


def connect(link: SourceLink) -> SimulatedSource:
    """Returns the source for a table of rig.toml."""
    return SimulatedSource(link)
