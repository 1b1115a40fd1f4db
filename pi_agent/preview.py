"""Pictures for people: a preview a few times a second, and every frame of a stretch of time on request.

Encoding runs in its own thread on copies, so that no picture ever delays a measurement.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass

import cv2

from pi_agent.calibration.model import Calibration
from pi_agent.cameras import Image
from pi_agent.frame_ring import FrameRing, KeptFrame
from shared import frames
from shared.bus import Bus
from shared.clock import Clock
from shared.messages import FrameReply, FrameRequest

LONGEST_REQUEST_NS = 30_000_000_000
FULL_QUALITY = 95


@dataclass(frozen=True)
class View:
    """The parts of an open camera that the thread needs: its frames, its calibration, the depth of the mark."""

    ring: FrameRing
    calibration: Calibration
    depth_m: float
    rate_hz: float


class Preview:
    """Publishes `camera/image` and `camera/image/overlay`."""

    def __init__(self, bus: Bus, clock: Clock, *, rate_hz: float, jpeg_quality: int) -> None:
        self._bus, self._clock = bus, clock
        self._interval_ns = round(1e9 / rate_hz) if rate_hz > 0 else 0
        self._quality = jpeg_quality
        self._view: View | None = None
        self._due_ns = 0
        self._wake = threading.Event()
        self._requests: list[FrameRequest] = []

    def attach(self, view: View) -> None:
        """Takes the camera that was opened."""
        self._view = view

    def frame_came(self, capture_ns: int) -> None:
        """Wakes the thread when there is something to do; called for every frame after it was put into the ring."""
        if self._requests or (self._interval_ns and capture_ns >= self._due_ns):
            self._wake.set()

    def request(self, wanted: FrameRequest) -> FrameReply:
        """Serves `camera/frames`: takes the request, or says why not."""
        view, now_ns = self._view, self._clock.now_ns()
        from_ns = wanted.from_ns or now_ns
        if view is None:
            return FrameReply(reason="the camera has not delivered a frame yet")
        if not 0 < wanted.to_ns - from_ns <= LONGEST_REQUEST_NS:
            return FrameReply(reason=f"expected to_ns after from_ns by at most {LONGEST_REQUEST_NS // 10**9} s")
        if from_ns > now_ns + LONGEST_REQUEST_NS:
            return FrameReply(reason="expected a stretch of time that begins soon; this one is too far in the future")
        kept = sum(from_ns <= stamp <= wanted.to_ns for stamp in view.ring.stamps())
        coming = max(wanted.to_ns - max(now_ns, from_ns), 0) * 1e-9 * view.rate_hz
        if kept + coming < 1:
            span_s = view.ring.capacity / view.rate_hz
            return FrameReply(reason=f"no frame of that time is kept any more: only the last {span_s:.1f} s are")
        self._requests = [*self._requests, FrameRequest(from_ns=from_ns, to_ns=wanted.to_ns)]
        self._wake.set()
        return FrameReply(frames=kept + round(coming))

    def run(self, stop: threading.Event) -> None:
        """Works until `stop` is set."""
        while not stop.is_set():
            self._wake.wait(0.2)
            self._wake.clear()
            self.work(stop.is_set)

    def work(self, stopped: Callable[[], bool] = lambda: False) -> None:
        """Sends what is due now."""
        if self._view is not None:
            self._serve_requests(self._view, stopped)
            self._preview(self._view)

    def _preview(self, view: View) -> None:
        kept = view.ring.latest() if self._interval_ns and not self._requests else None
        if kept is None or kept.capture_ns < self._due_ns:
            return
        # Due times stand on a grid, so that the mean rate is the one asked for whatever the camera's is.
        late = (kept.capture_ns - self._due_ns) // self._interval_ns
        self._due_ns = kept.capture_ns + self._interval_ns if late > 1 else self._due_ns + self._interval_ns
        self._publish(kept, view, quality=self._quality)

    def _serve_requests(self, view: View, stopped: Callable[[], bool]) -> None:
        while self._requests and not stopped():
            request = self._requests[0]
            kept = view.ring.next_after(request.from_ns - 1)
            if kept is not None and kept.capture_ns <= request.to_ns:
                self._publish(kept, view, quality=FULL_QUALITY)
                self._requests[0] = FrameRequest(from_ns=kept.capture_ns + 1, to_ns=request.to_ns)
            elif kept is not None or self._clock.now_ns() > request.to_ns + 10**9:
                self._requests = self._requests[1:]
            else:
                return

    def _publish(self, kept: KeptFrame, view: View, *, quality: int) -> None:
        data = encode(kept.image, quality=quality)
        self._bus.publish("camera/image", frames.image(data, stamp_ns=kept.capture_ns))
        drawn = frames.overlay(
            kept.corners.corners_px, K=view.calibration.intrinsics, depth_m=view.depth_m, stamp_ns=kept.capture_ns
        )
        self._bus.publish("camera/image/overlay", drawn)


def encode(image: Image, *, quality: int) -> bytes:
    """Returns a JPEG of the picture `image` (height, width), 8-bit grey values."""
    return cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()
