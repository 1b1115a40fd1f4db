"""The machine's memory of the stream: attitudes and corners of the last seconds, on the station's clock."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

import numpy as np

from shared.foxglove import CameraCalibration
from shared.geometry import Array, block_pose_of, corners_on_plate, euler_of, straightened, tilt_of
from shared.messages import REPEATED, CameraGeometry, MarkerCorners, PlatformState
from station.friction.onset import Onset, estimate_onset
from station.rig.opening import Opening, square_corners
from station.sampling.clocks import Clocks
from station.sampling.no_slide import Seen
from station.sampling.slip import displacements_px
from station.sampling.stuck import Turning
from station.signals.mark_side import contradiction
from station.signals.traced import trace

_Frame = tuple[int, tuple[float, ...]]
"""A frame's time, ns, and its corners, px."""

_ATTITUDES = 600
_FRAMES = 540
_STARTS = 64
"""The starts of the camera agent that are remembered: it starts a few times in a session, and ids that somebody makes
up must not fill the memory (`pytest tests/unit/sampling/test_machine.py -k camera` has two)."""


def usable(message: MarkerCorners) -> bool:
    """Returns true if a frame shows where the marker is: found, with four finite corners."""
    return message.found and len(message.corners_px) == 8 and math.isfinite(sum(message.corners_px))


@dataclass(slots=True)
class Tracks:
    """The newest state of the rig and the last six seconds of it."""

    geometry: CameraGeometry | None = None
    lens: CameraCalibration | None = None
    tilt_rad: float = 0.0
    attitude_ns: int = 0
    frame_ns: int = 0
    clocks: Clocks = field(default_factory=Clocks)
    turning: Turning = field(default_factory=Turning)
    _last: MarkerCorners | None = None
    _starts: deque[int] = field(default_factory=lambda: deque(maxlen=_STARTS))
    _attitudes: deque[tuple[int, float]] = field(default_factory=lambda: deque(maxlen=_ATTITUDES))
    _quaternions: deque[tuple[int, tuple[float, float, float, float]]] = field(default_factory=lambda: deque(maxlen=64))
    _frames: deque[_Frame] = field(default_factory=lambda: deque(maxlen=_FRAMES))

    def take_attitude(self, message: PlatformState, *, now_ns: int, within_s: float) -> bool:
        """Takes the plate's attitude, stamped by the arm's clock; False if that is not within so many s of now.

        It is neither while that clock is not known. One of another time says nothing of the plate as it is, and the
        onset's fit would span all of the time between.
        """
        offset_ns = self.clocks.offset_ns("arm", now_ns=now_ns)
        if offset_ns is None or abs(now_ns - message.stamp_ns - offset_ns) > within_s * 1e9:
            return False
        stamp_ns = message.stamp_ns + offset_ns
        q = (message.qw, message.qx, message.qy, message.qz)
        self.attitude_ns = stamp_ns
        self.tilt_rad = tilt_of(*q)
        self.turning.take(message, stamp_ns=stamp_ns)
        self._attitudes.append((self.attitude_ns, self.tilt_rad))
        self._quaternions.append((self.attitude_ns, q))
        return True

    def is_from_another(self, message: MarkerCorners) -> bool:
        """Returns true if a camera's start comes back that frames of a later start have followed: two send."""
        return self._last is not None and message.boot_id != self._last.boot_id and message.boot_id in self._starts

    def repeats(self, message: MarkerCorners) -> bool:
        """Returns true if a frame is the one before again: stamped no later, or with the very same corners.

        A camera without noise, which says so (`noiseless`, or a `sigma_px` of zero), gives the same corners for as long
        as the block lies still; with noise that does not happen to eight numbers at once.
        """
        last = self._last
        if message.reason == REPEATED or last is None:
            return message.reason == REPEATED
        if message.boot_id == last.boot_id and message.capture_ns <= last.capture_ns:
            return True
        noisy = message.sigma_px > 0 and not message.noiseless
        return noisy and bool(message.corners_px) and message.corners_px == last.corners_px

    def take_corners(self, message: MarkerCorners, *, offset_ns: int) -> bool:
        """Takes a frame's corners by the camera's clock, at `frame_ns` by the station's; True if they are usable."""
        if self._last is not None and message.boot_id != self._last.boot_id:
            self._starts.append(self._last.boot_id)
        self._last = message
        self.frame_ns = message.capture_ns + offset_ns
        if not usable(message):
            return False
        # With a rolling shutter each corner has its own time; the centre's is their mean.
        shift_ns = sum(message.corner_dt_ns) // 4 if len(message.corner_dt_ns) == 4 else 0
        self._frames.append((self.frame_ns + shift_ns, message.corners_px))
        return True

    def pose_of(self, corners_px: tuple[float, ...]) -> tuple[float, float, float]:
        """Returns the block's x, y (m) and yaw (rad) on the plate; zeros without corners or calibration."""
        if self.geometry is None or not corners_px:
            return 0.0, 0.0, 0.0
        return block_pose_of(straightened(corners_px, self.lens).ravel().tolist(), self.geometry)

    def off_scale(self, corners_px: tuple[float, ...]) -> float:
        """Returns the share by which the mark's own side contradicts the plate's scale; 0 without calibration."""
        return 0.0 if self.geometry is None else contradiction(straightened(corners_px, self.lens), self.geometry)

    def way_px(self, corners_px: tuple[float, ...], opening: Opening, *, side_m: float, azimuth_rad: float) -> float:
        """Returns how far, px, a square block slides when tilted at β until the foam stops it; inf if not known."""
        if self.geometry is None or not corners_px or not opening.walled or not self.geometry.mm_per_px > 0:
            return math.inf
        block = square_corners(0.5 * side_m, self.pose_of(corners_px))
        pull = np.array([[math.sin(azimuth_rad), -math.cos(azimuth_rad)]])
        return float(opening.way_m(block, pull)[0]) * 1e3 / self.geometry.mm_per_px

    def mean_euler_rad(self, *, from_ns: int) -> tuple[float, float, float]:
        """Returns the mean of the attitude readings since `from_ns`."""
        readings = [q for stamp, q in self._quaternions if stamp >= from_ns] or [self._quaternions[-1][1]]
        mean = np.mean([euler_of(*q) for q in readings], axis=0)
        return float(mean[0]), float(mean[1]), float(mean[2])

    def mean_tilt_rad(self, *, from_ns: int) -> float:
        """Returns the mean tilt since `from_ns`."""
        return float(np.mean([tilt for stamp, tilt in self._attitudes if stamp >= from_ns] or [self.tilt_rad]))

    def mean_corners_px(self, count: int) -> tuple[float, ...]:
        """Returns the mean of the last `count` frames' corners; empty if there are none."""
        frames = [corners for _, corners in list(self._frames)[-count:]]
        return tuple(float(value) for value in np.mean(frames, axis=0)) if frames else ()

    def moved_px(self, reference_px: tuple[float, ...], *, since_ns: int, until_ns: int) -> list[tuple[int, float]]:
        """Returns each frame's time, ns, and how far its corners lay from the reference, px, in the mean."""
        return [
            (stamp, float(np.mean(displacements_px(corners, reference_px))))
            for stamp, corners in self._frames
            if since_ns <= stamp <= until_ns
        ]

    def seen(self, *, since_ns: int, until_ns: int) -> Seen | None:
        """Returns the path of the block in some frames; None without calibration, frames or attitudes."""
        # A clock that is set back gives a time twice; the later frame has it.
        frames = sorted(dict(frame for frame in self._frames if since_ns <= frame[0] <= until_ns).items())
        if self.geometry is None or not frames or not self._attitudes:
            return None
        stamps, readings = np.array([stamp for stamp, _ in frames]), list(self._attitudes)
        tilt_rad = np.interp(stamps, [stamp for stamp, _ in readings], [tilt for _, tilt in readings])
        centres = straightened([corners for _, corners in frames], self.lens).reshape(-1, 4, 2).mean(axis=1)
        return Seen(stamps, corners_on_plate(centres, self.geometry), tilt_rad)

    def outline_m(self, seen: Seen, *, side_m: float) -> Array:
        """Returns the corners (n, 4, 2), m on the plate, of a square block with that side in the frames of a path."""
        frames = dict(self._frames)
        poses = [self.pose_of(frames[stamp]) for stamp in seen.time_ns.tolist()]
        return np.concatenate([square_corners(0.5 * side_m, pose) for pose in poses])

    def attitudes_ns(self, *, since_ns: int) -> list[int]:
        """Returns the times, ns, of the attitudes."""
        return [stamp for stamp, _ in self._attitudes if stamp >= since_ns]

    def onset(
        self, seen: Seen, *, since_ns: int, downhill: tuple[float, float], sigma_px: float, scale_sigma: float
    ) -> Onset | None:
        """Gives the onset of the slide at the end of a path that was `seen` since then; None where there is none."""
        attitudes = [(stamp, tilt) for stamp, tilt in self._attitudes if stamp >= since_ns - 100_000_000]
        if self.geometry is None or len(seen.time_ns) < 2 or len(attitudes) < 2:
            return None
        return trace(
            estimate_onset,
            seen.time_ns,
            seen.place_m,
            start_m=seen.place_m[0],
            down=downhill,
            tilt_ns=[stamp for stamp, _ in attitudes],
            tilt_rad=[tilt for _, tilt in attitudes],
            # The centre is the mean of four corners.
            sigma_m=0.5 * sigma_px * self.geometry.mm_per_px * 1e-3,
            clock_sigma_s=self.clocks.sigma_s(now_ns=int(seen.time_ns[-1])),
            scale_sigma=scale_sigma,
        )
