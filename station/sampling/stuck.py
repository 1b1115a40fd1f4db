"""Encoders that are stuck: an attitude that is sent again and again while the plate turns is no reading of it.

A plate at rest has the same attitude again and again, and so has one that does not turn yet. A stuck reading shows in
what comes after it: nothing else by the end of the motion, or a jump by all that the plate has turned meanwhile.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

_REMEMBERED = 64
"""The stretches that are remembered: two a step of the tilt, of which the shortest last a tenth of a second."""

Quaternion = tuple[float, float, float, float]


@dataclass(slots=True)
class _Stretch:
    """The last time, ns, of a reading that came again, how long it did in motions, ns, and its tilt, rad.

    The next one came `next_s` later, and had that tilt, rad.
    """

    tilt_rad: float
    last_ns: int = 0
    lasted_ns: int = 0
    next_rad: float = math.nan
    next_s: float = 0.0

    def end(self, tilt_rad: float, *, stamp_ns: int) -> None:
        """Takes the first reading that is another one."""
        self.next_rad, self.next_s = tilt_rad, (stamp_ns - self.last_ns) * 1e-9

    def is_stuck(self, rate_rad_s: float) -> bool:
        """Returns true if the plate turned meanwhile: nothing came after, or more than it turns between two readings.

        The arm may turn it a little faster than was asked for, but not twice as fast.
        """
        return math.isnan(self.next_rad) or abs(self.next_rad - self.tilt_rad) > 2.0 * rate_rad_s * self.next_s


@dataclass(slots=True)
class Repeats:
    """The stretches of equal readings in motions of the plate."""

    _turning: bool = False
    _turned: bool = True
    _quaternion: Quaternion | None = None
    _stamp_ns: int = 0
    _stretches: deque[_Stretch] = field(default_factory=lambda: deque(maxlen=_REMEMBERED))

    def take_motion(self, *, under_way: bool) -> None:
        """Takes the begin or the end of a motion."""
        self._turning = under_way
        self._turned = self._turned and not under_way

    def take(self, quaternion: Quaternion, *, tilt_rad: float, stamp_ns: int) -> None:
        """Takes a reading of the plate's attitude, whose tilt is that many rad."""
        if quaternion != self._quaternion:
            if self._stretches and math.isnan(self._stretches[-1].next_rad):
                self._stretches[-1].end(tilt_rad, stamp_ns=stamp_ns)
            self._turned = True
        elif self._turning or not self._turned:
            if not self._stretches or not math.isnan(self._stretches[-1].next_rad):
                self._stretches.append(_Stretch(tilt_rad))
            self._stretches[-1].last_ns = stamp_ns
            self._stretches[-1].lasted_ns += stamp_ns - self._stamp_ns
        self._quaternion, self._stamp_ns = quaternion, stamp_ns

    def are_stuck(self, *, since_ns: int, slide_ns: int, rate_rad_s: float) -> bool:
        """Returns true if readings since then were stuck for longer than half of a slide: its fit took them for true.

        Coarse encoders are not stuck: one of 0.1 degrees in a motion of 0.25 degrees/s reads anew every 0.4 s, which
        is half of the time that such slow slides take up to their detection (6 mm).
        """
        return any(
            stretch.last_ns > since_ns and 2 * stretch.lasted_ns > slide_ns and stretch.is_stuck(rate_rad_s)
            for stretch in self._stretches
        )
