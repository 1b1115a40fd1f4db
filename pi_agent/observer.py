"""Makes the messages about a frame: pure, without clock, thread or bus, so that it runs in lockstep too."""

from __future__ import annotations

import numpy as np

from pi_agent.calibration.model import Calibration, nominal
from pi_agent.cameras import CameraInfo, Frame
from pi_agent.marks import FIDUCIAL_MARGIN, block_mark, fiducial_mark, fiducial_places_mm, require_visible
from pi_agent.repeats import Repeats
from pi_agent.tracking.config import TrackerConfig
from pi_agent.tracking.mark import Mark
from pi_agent.tracking.observation import Observation
from pi_agent.tracking.tracker import Tracker
from shared.geometry import apply_homography
from shared.messages import REPEATED, MarkerCorners
from shared.rig import RigConfig

BLOCK = 0
SIDE_TOLERANCE = (0.72, 1.35)
"""The factor by which a mark may look smaller or larger than expected: the nominal view is only roughly known."""
FIDUCIAL_ROOM = 0.9
"""Room around a fiducial in which it is looked for, in its sides."""


class Observer:
    """Follows the block's mark and the plate's fiducials through the frames of one camera.

    `boot_id` tells one life of the agent from the next. The trackers are remembered from frame to frame.

    Raises:
        UserError: as `require_visible`.
    """

    def __init__(
        self, rig: RigConfig, info: CameraInfo, *, boot_id: int = 0, calibration: Calibration | None = None
    ) -> None:
        self._rig, self._info, self._boot_id = rig, info, boot_id
        known = calibration or nominal(rig, width_px=info.width_px, height_px=info.height_px)
        require_visible(rig, camera_m=known.camera_m[2])
        self._px_per_mm = 1.0 / known.mm_per_px
        self._block = Tracker(self._config(block_mark(rig.mark), known, height_m=rig.block.size_m[2]))
        self._plate = self._fiducial_trackers(known)
        self._plate_due_ns: list[int] = []
        self._repeats, self.repeated = Repeats(info), False
        self.identity = ""
        """The way in which the block's corners were told apart in the last frame: see `Observation.identity`."""

    def _config(
        self, mark: Mark, known: Calibration, *, height_m: float = 0.0, region: tuple[int, int, int, int] | None = None
    ) -> TrackerConfig:
        side = mark.side_mm * self._px_per_mm / (1.0 - height_m / known.camera_m[2])
        return TrackerConfig(
            mark=mark,
            side_px=(SIDE_TOLERANCE[0] * side, SIDE_TOLERANCE[1] * side),
            tone=known.tone(self._info.tone),
            shutter=self._info.row_times,
            region_px=region,
        )

    def _fiducial_trackers(self, known: Calibration) -> dict[int, Tracker]:
        """Returns a tracker for each fiducial that lies in the picture, by marker id."""
        plate = self._rig.plate
        if plate.fiducial_side_mm <= 0 or self._rig.camera.plate_rate_hz <= 0:
            return {}
        mark = fiducial_mark(plate)
        places_m = 1e-3 * np.array(fiducial_places_mm(plate))
        half = round((0.5 + FIDUCIAL_MARGIN + FIDUCIAL_ROOM) * mark.side_mm * self._px_per_mm)
        pixel_from_plate = np.asarray(np.linalg.inv(known.homography), dtype=np.float64)
        trackers: dict[int, Tracker] = {}
        for number, (x, y) in enumerate(apply_homography(pixel_from_plate, places_m), start=1):
            inside = 0 < x < self._info.width_px and 0 < y < self._info.height_px
            if inside:
                region = (round(x) - half, round(y) - half, 2 * half + 1, 2 * half + 1)
                trackers[number] = Tracker(self._config(mark, known, region=region))
        return trackers

    def block(self, frame: Frame) -> MarkerCorners:
        """Returns the block's mark in a frame; one that was there before shows nothing."""
        self.repeated = self._repeats.see(frame)
        if self.repeated:
            return self._nothing(frame)
        seen = self._block.track(frame.image, capture_ns=frame.capture_ns)
        self.identity = seen.identity
        return self._message(seen, frame, marker_id=BLOCK)

    def mark(self, frame: Frame, marker_id: int) -> MarkerCorners | None:
        """Returns the mark of that number in a frame, whoever's turn it is; None if the rig shows no such mark."""
        if marker_id == BLOCK:
            return self.block(frame)
        tracker = self._plate.get(marker_id)
        if tracker is None:
            return None
        return self._message(tracker.track(frame.image, capture_ns=frame.capture_ns), frame, marker_id=marker_id)

    def plate(self, frame: Frame) -> list[MarkerCorners]:
        """Returns the fiducials whose turn it is: each comes `plate_rate_hz` times a second.

        They are looked at one after another, at most one in a frame if the rates allow, which spreads their cost.
        """
        if not self._plate or self.repeated:
            return []
        interval_ns = round(1e9 / self._rig.camera.plate_rate_hz)
        if not self._plate_due_ns:
            share = interval_ns // len(self._plate)
            self._plate_due_ns = [frame.capture_ns + index * share for index in range(len(self._plate))]
        reports: list[MarkerCorners] = []
        for index, (marker_id, tracker) in enumerate(self._plate.items()):
            due_ns = self._plate_due_ns[index]
            if frame.capture_ns >= due_ns:
                late_ns = (frame.capture_ns - due_ns) // interval_ns * interval_ns
                self._plate_due_ns[index] = due_ns + late_ns + interval_ns
                seen = tracker.track(frame.image, capture_ns=frame.capture_ns)
                reports.append(self._message(seen, frame, marker_id=marker_id))
        return reports

    def _nothing(self, frame: Frame) -> MarkerCorners:
        exposure_ns = frame.exposure_ns or self._info.exposure_ns
        return MarkerCorners(
            capture_ns=frame.capture_ns,
            seq=frame.seq,
            exposure_ns=exposure_ns,
            reason=REPEATED,
            marker_id=BLOCK,
            boot_id=self._boot_id,
        )

    def _message(self, seen: Observation, frame: Frame, *, marker_id: int) -> MarkerCorners:
        known = bool(np.all(np.isfinite(seen.corners_px)))
        return MarkerCorners(
            capture_ns=frame.capture_ns,
            seq=frame.seq,
            corners_px=tuple(seen.corners_px.ravel().tolist()) if known else (),
            sigma_px=seen.sigma_px if known else 0.0,
            residual_px=seen.residual_px if known else 0.0,
            exposure_ns=frame.exposure_ns or self._info.exposure_ns,
            corner_dt_ns=seen.corner_dt_ns if known else (),
            found=seen.found,
            reason=seen.reason,
            marker_id=marker_id,
            boot_id=self._boot_id,
            tipped=seen.tip_rad > 0,
            noiseless=self._info.noiseless,
        )
