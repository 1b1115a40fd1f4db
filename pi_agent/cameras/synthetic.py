"""The synthetic camera: what the camera would see of the twin, drawn at the camera's rate in real time.

Frames are due at the camera's rate, as a sensor's are, and are taken at the moments of the twin's scenes, of which two
come to a frame: so a picture is of the true moment, and nobody waits for the scene after it. A process that is too late
skips frames and counts them.
"""

from __future__ import annotations

import threading
import time
from collections import deque

import numpy as np

from pi_agent.cameras import CameraContext, CameraInfo, Frame
from pi_agent.synthetic_view import SyntheticOptions, SyntheticView
from shared.bus import Received
from shared.config import parse
from shared.errors import UserError
from shared.messages import TwinScene

PATIENCE_S = 0.008
"""The time that a frame waits for the scene after its moment, before the block is moved on from the last one."""
LATE_FRAMES = 3
"""Frames that are this late are still drawn, one after another, as a camera's buffers would hold them; a reader that is
later gets the newest. A scheduler's hiccup of 30 ms then costs no frame, and nothing piles up."""
STALE_NS = 500_000_000
SILENCE_S = 1.0
EARLY = 0.25
"""A scene that is this share of a period before a frame's moment is that frame's."""
APART_S = 2.0
"""A busy machine makes a twin late by less than this."""
KEPT_SCENES = 64


class SyntheticCamera:
    """Subscribes to `truth/scene` once and for all; only scenes that came since `open` are drawn."""

    def __init__(self, context: CameraContext) -> None:
        self._rig, self._clock = context.rig, context.clock
        self._options = parse(SyntheticOptions, context.rig.camera.options)
        self._arrived: deque[Received] = deque(maxlen=KEPT_SCENES)
        self._came = threading.Event()
        self._scenes: deque[TwinScene] = deque(maxlen=KEPT_SCENES)
        self._view: SyntheticView | None = None
        self._start_ns = self._last_scene_ns = self._capture_ns = 0
        self._seq, self._dropped = -1, 0
        self._waiting = True
        context.bus.subscribe("truth/scene", self._take, direct=True)

    def _take(self, received: Received) -> None:
        self._arrived.append(received)
        self._came.set()

    def open(self) -> CameraInfo:
        """Makes the renderer if there is none yet, and begins to count frames anew."""
        if self._view is None:
            self._view = SyntheticView(self._rig, rng=np.random.default_rng(self._options.seed), options=self._options)
        self._start_ns = self._last_scene_ns = self._clock.now_ns()
        self._capture_ns = 0
        self._seq, self._dropped, self._waiting = -1, 0, True
        return self._view.info

    def read(self, timeout_s: float) -> Frame | None:
        """Waits for the next moment of the frame rate and draws the twin's scene at it; None after `timeout_s`.

        Raises:
            UserError: if it is not open, or no usable scene comes from the twin.
        """
        if self._view is None:
            raise UserError("Expected an open camera, got one that is closed")
        deadline_ns = self._clock.now_ns() + round(timeout_s * 1e9)
        while self._clock.now_ns() < deadline_ns:
            capture_ns = self._next_tick()
            scenes = self._scenes_about(capture_ns)
            if scenes:
                self._capture_ns = capture_ns = self._moment_of(scenes[-1], capture_ns)
                self._waiting = False
                image = self._view.frame(scenes[-1], capture_ns, before=scenes[:-1])
                return Frame(image, capture_ns, self._seq, self._dropped)
            self._waiting = True
            self._seq -= 1  # there was nothing to take a picture of
            self._check_silence()
        return None

    def close(self) -> None:
        """Drops the scenes that have arrived."""
        self._arrived.clear()
        self._scenes.clear()

    def _next_tick(self) -> int:
        """Waits for the next frame's moment; moments that have long passed are frames that were dropped.

        While there is no scene to draw there are no frames, and so none to drop.
        """
        period_ns = 1e9 / self._rig.camera.rate_hz
        due = self._seq + 1
        late = int((self._clock.now_ns() - self._start_ns) / period_ns) - due
        if self._waiting and late > 0:
            self._start_ns += round(late * period_ns)
        elif late > LATE_FRAMES:
            self._dropped += late
            due += late
        self._seq = due
        capture_ns = self._start_ns + round(due * period_ns)
        time.sleep(max(capture_ns - self._clock.now_ns(), 0) * 1e-9)
        return capture_ns

    def _moment_of(self, scene: TwinScene, due_ns: int) -> int:
        """Returns the frame's moment: its scene's, if that came in time and is none of the frame before.

        The first frames set the phase by their scenes.
        """
        period_ns = 1e9 / self._rig.camera.rate_hz
        if abs(scene.stamp_ns - due_ns) > 0.75 * period_ns or scene.stamp_ns <= self._capture_ns:
            return max(due_ns, self._capture_ns + 1)
        if self._waiting:
            self._start_ns += scene.stamp_ns - due_ns
        return scene.stamp_ns

    def _scenes_about(self, due_ns: int) -> list[TwinScene]:
        """Returns the scene of a moment, after the two before it; the last ones when it did not come in time."""
        capture_ns = due_ns - round(EARLY * 1e9 / self._rig.camera.rate_hz)
        give_up = time.monotonic() + PATIENCE_S
        while True:
            self._came.clear()
            self._decode()
            waited = time.monotonic() >= give_up
            if self._scenes and (self._scenes[-1].stamp_ns >= capture_ns or waited):
                break
            if waited:
                return []
            self._came.wait(max(give_up - time.monotonic(), 0))
        scenes = list(self._scenes)
        if abs(scenes[-1].stamp_ns - capture_ns) > STALE_NS:
            return []
        last = len(scenes) - 1
        while last > 1 and scenes[last - 1].stamp_ns >= capture_ns:
            last -= 1
        return scenes[max(last - 2, 0) : last + 1]

    def _decode(self) -> None:
        while self._arrived:
            message = self._arrived.popleft().message
            if isinstance(message, TwinScene):
                self._scenes.append(message)
                self._last_scene_ns = self._clock.now_ns()

    def _check_silence(self) -> None:
        silent_s = (self._clock.now_ns() - self._last_scene_ns) * 1e-9
        if silent_s > SILENCE_S:
            raise UserError("No scene comes from the twin: start `station twin`")
        apart_s = (self._scenes[-1].stamp_ns - self._clock.now_ns()) * 1e-9 if self._scenes else 0.0
        if abs(apart_s) > APART_S and silent_s < STALE_NS * 1e-9:
            raise UserError(
                f"the twin's scenes are stamped {apart_s:+.1f} s from this clock: run both by the same clock, and on a "
                "machine that is not too busy for them"
            )


def build(context: CameraContext) -> SyntheticCamera:
    """Builds the synthetic camera of a rig."""
    return SyntheticCamera(context)
