"""The camera's thread: opens it, reads it, and opens it again when it fails."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable

from pi_agent.cameras import Camera, CameraInfo, Frame
from pi_agent.journal import Journal
from shared.errors import UserError

READ_S = 0.25
SILENCE_S = 1.5
RETRY_S = 0.5


class Capture:
    """Feeds `on_frame` with a camera's frames; nothing else runs in its way.

    `fault` is why no frames come, in one sentence; a frame clears it.
    """

    def __init__(
        self,
        camera: Camera,
        *,
        on_open: Callable[[CameraInfo], None],
        on_frame: Callable[[Frame], None],
        journal: Journal,
    ) -> None:
        self._camera, self._on_open, self._on_frame, self._journal = camera, on_open, on_frame, journal
        self.fault = ""

    def run(self, stop: threading.Event) -> None:
        """Works until `stop` is set; a fault is tried again, however often."""
        while not stop.is_set():
            try:
                self._on_open(self._camera.open())
                self._read(stop)
            except UserError as error:
                self._fail(str(error))
            except Exception as error:
                # Whatever a driver throws, the agent lives on and says it.
                self._fail(f"The camera failed unexpectedly ({type(error).__name__}: {error}); it is opened again")
            finally:
                with contextlib.suppress(Exception):
                    self._camera.close()
            stop.wait(RETRY_S)

    def _read(self, stop: threading.Event) -> None:
        last_s = time.monotonic()
        while not stop.is_set():
            frame = self._camera.read(READ_S)
            if frame is not None:
                last_s = time.monotonic()
                self._recovered()
                self._on_frame(frame)
            elif time.monotonic() - last_s > SILENCE_S:
                raise UserError(
                    f"No frame from the camera for {SILENCE_S} s: check its cable, and that nothing else uses it"
                )

    def _fail(self, sentence: str) -> None:
        if sentence != self.fault:
            self.fault = sentence
            self._journal.error(sentence)

    def _recovered(self) -> None:
        if self.fault:
            self.fault = ""
            self._journal.info("Frames come again")
