"""Encoders that are stuck: readings of the plate's attitude that contradict what the plate did meanwhile.

There are two witnesses of that. The rates that come with the readings say by how much the plate turned between them;
a reading that is stuck, whole or in one of its joints, falls behind their sum or runs ahead of it. The motions that
were asked for say how fast the plate turns at most, and where it comes to rest; a reading that is released jumps, and
one that never is does not come back to level. Both hold for equal readings as for noisy ones, and for a plate at rest.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

import numpy as np

from shared.geometry import Array
from shared.messages import PlatformState
from station.sampling.no_slide import UNLEVEL_RAD
from station.signals.downhill import LEAST

_REMEMBERED = 6000
"""The readings that are remembered, a minute of them or twelve seconds of an arm that sends 500 a second: from three
seconds before a slide until the plate is level again."""
_LAG_S = 0.08
"""The rates may lie so far behind the readings, as drivers smooth them over up to that time, and no longer may readings
stay away for their rates to be summed. Twice as much would leave a joint of the JACO2 unnoticed that was stuck from
0.4 s before a slide on; a fourth would flag sound runs at 14 degrees/s whose rates are smoothed over 40 ms
(`pytest tests/unit/sampling/test_stuck.py`)."""
_OFF_RAD = math.radians(0.3)
"""An arm at rest may be so far from its goal (`settle_tolerance_deg`), and jerk by as much when it moves slowly."""
_PEAK = 2.0
"""The largest rate of a motion over the one asked for: an arm that means it as the mean of a quintic has 1.9 of it."""
_NOISE = 10.0
"""The spread that is left to noise, in standard errors: of a thousand normal numbers it is 6.5, and 8 once in 10⁵."""
_WALK = 5.0
"""The sum of the rates' noise that is left to it, in standard errors."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """The motions of a run: up at `rate_rad_s`, and down to level at `return_rad_s`.

    `reached_rad` is the angle at which the plate had come to rest last before the slide, and `level` is true once it
    is said to be level again.
    """

    rate_rad_s: float
    return_rad_s: float
    reached_rad: float
    level: bool


@dataclass(slots=True)
class Turning:
    """The plate's attitudes of the last seconds, with their rates."""

    _readings: deque[tuple[int, PlatformState]] = field(default_factory=lambda: deque(maxlen=_REMEMBERED))

    def take(self, message: PlatformState, *, stamp_ns: int) -> None:
        """Takes a reading, and its time on the station's clock; one that is no later than the last tells nothing."""
        if not self._readings or stamp_ns > self._readings[-1][0]:
            self._readings.append((stamp_ns, message))

    def contradicts(self, asked: Asked, *, since_ns: int, detect_ns: int) -> bool:
        """Returns true if the readings since then cannot be those of the plate that turned as its rates and motions."""
        rows = [(stamp, *_numbers(state)) for stamp, state in self._readings if stamp >= since_ns]
        if len(rows) < 5:
            return False
        table = np.array([row[1:] for row in rows])
        stamps_ns = np.array([row[0] for row in rows])
        time_s = (stamps_ns - stamps_ns[0]) * 1e-9
        up, rates = _up(table[:, :4]), table[:, 4:]
        way = up[np.searchsorted(stamps_ns[:-1], detect_ns), :2]
        tilt, rising = _tilt(up, way), stamps_ns <= detect_ns
        # Seen from the plate, the zenith turns against it.
        told = _tilt(up[:-1] + np.diff(time_s)[:, None] * np.cross(up[:-1], 0.5 * (rates[1:] + rates[:-1])), way)
        if rates.any() and _parts(time_s[rising], tilt[rising], told - tilt[:-1], rate_rad_s=asked.rate_rad_s):
            return True
        if _outpaces(time_s, tilt, asked=asked):
            return True
        slid_rad = float(np.interp(detect_ns, stamps_ns, tilt))
        stayed = slid_rad + UNLEVEL_RAD < 0.5 * asked.reached_rad
        return stayed or (asked.level and float(tilt[-1]) - UNLEVEL_RAD > 0.5 * slid_rad)


def _numbers(state: PlatformState) -> tuple[float, ...]:
    return state.qw, state.qx, state.qy, state.qz, state.wx, state.wy, state.wz


def _outpaces(time_s: Array, tilt_rad: Array, *, asked: Asked) -> bool:
    """Returns true if the tilt changes by more, somewhere, than the motions can have turned the plate."""
    passed_s = np.diff(time_s, prepend=time_s[:1])
    allowed_rad = _OFF_RAD + _NOISE * _noise(tilt_rad)
    up = tilt_rad - np.cumsum(_PEAK * asked.rate_rad_s * passed_s)
    down = -tilt_rad - np.cumsum(_PEAK * asked.return_rad_s * passed_s)
    return max(_rise(up), _rise(down)) > allowed_rad


def _rise(values: Array) -> float:
    """Returns the largest rise of values (n,) from any of them to a later one."""
    return float((values - np.minimum.accumulate(values)).max())


def _parts(time_s: Array, tilt_rad: Array, told_rad: Array, *, rate_rad_s: float) -> bool:
    """Returns true if the tilt parts from the sum of the plate's own rates by more than lag and noise of both leave.

    Args:
        time_s: times (n,) of the readings.
        tilt_rad: tilts (n,).
        told_rad: the changes (n - 1 or more,) of the tilt from reading to reading that the rates tell.
        rate_rad_s: the rate of the tilt that was asked for.
    """
    if len(time_s) < 5:
        return False
    passed_s = np.diff(time_s)
    told_rad = told_rad[: len(passed_s)]
    off_rad = np.where(passed_s <= _LAG_S, np.diff(tilt_rad) - told_rad, 0.0)
    walked_rad = _noise(told_rad / passed_s) * float(np.sqrt(np.sum(passed_s**2)))
    allowed_rad = _LAG_S * rate_rad_s + _NOISE * _noise(tilt_rad) + _WALK * walked_rad
    return float(np.ptp(np.cumsum(off_rad))) > allowed_rad


def _up(quaternions: Array) -> Array:
    """Returns the unit vectors (n, 3) towards the zenith in the plate's frame, by world_from_plate (n, 4)."""
    w, x, y, z = quaternions.T
    return np.stack([2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z], axis=1)


def _tilt(up: Array, way: Array) -> Array:
    """Returns the tilts (n,), rad, by vectors (n, 3) towards the zenith, and along the way (2,) on the plate alone.

    A plate that is called level and leans the other way has a negative one: its size would fall and rise again.
    """
    return np.arctan2(up[:, :2] @ way / max(float(np.hypot(*way)), LEAST), up[:, 2])


def _noise(values: Array) -> float:
    """Returns the noise of readings (n,), or their step, by their third differences, which hold √20 of it."""
    return float(np.sqrt(np.mean(np.diff(values, 3) ** 2) / 20.0))
