"""The camera behind the page: its pictures as they come, another exposure, pictures of the board, a calibration."""

from __future__ import annotations

import contextlib
import dataclasses
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2

from pi_agent.calibration.kept import Kept
from pi_agent.cameras import Camera, CameraContext, CameraInfo, load_camera
from pi_agent.page.seen import Seen, Watcher
from shared.errors import UserError
from shared.rig import RigConfig

READ_S = 0.25
EVERY_S = 0.15
"""A picture is measured so often: a hand that turns a lens follows that, and a Pi has a core left for the rest."""
SILENCE_S, RETRY_S = 1.5, 0.5
LONGEST_MS = 100.0
BOARD = "board-{:03d}.png"

Calibrating = Callable[[RigConfig, Path | None], Kept]
"""Calibrates with a rig and, if there are any, the folder with pictures of the board."""


class Eye:
    """Owns the camera, on the thread that calls `run`; everything else may be asked on any thread."""

    def __init__(self, context: CameraContext, *, calibrating: Calibrating, boards: Path) -> None:
        self._context, self._calibrating, self._boards = context, calibrating, boards
        self._lock = threading.Condition()
        self._exposure_ms = context.rig.camera.exposure_ms
        self._asked: bool | None = None
        self._again = False
        self._info: CameraInfo | None = None
        self._count = 0
        self.seen: Seen | None = None
        self.kept: Kept | None = None
        self._fault, self._refused, self._busy = "", "", False

    # --- what a page asks for ----------------------------------------------------------------------------------------

    def expose(self, exposure_ms: float) -> None:
        """Opens the camera again with another exposure; nothing is written.

        Raises:
            UserError: if no camera exposes so long.
        """
        if not 0.0 < exposure_ms <= LONGEST_MS:
            raise UserError(f"Expected an exposure above 0 and up to {LONGEST_MS:g} ms, got {exposure_ms:g}")
        with self._lock:
            self._refuse_if_busy()
            self._exposure_ms, self._again = exposure_ms, True

    def calibrate(self, *, with_lens: bool) -> None:
        """Calibrates the camera, with the pictures of the board if wanted.

        Raises:
            UserError: if it does so already.
        """
        with self._lock:
            self._refuse_if_busy()
            self._asked, self._busy, self._refused, self.kept = with_lens, True, "", None

    def keep_board(self) -> None:
        """Keeps the newest picture as one of the board.

        Raises:
            UserError: if there is none, or it cannot be written.
        """
        seen = self.seen
        if seen is None:
            raise UserError("Expected a picture from the camera, but none has come yet")
        self._boards.mkdir(parents=True, exist_ok=True)
        file = self._boards / BOARD.format(self.boards)
        if not cv2.imwrite(str(file), seen.image):
            raise UserError(f"Expected to write {file}, but OpenCV cannot: is the disk full?")

    @property
    def boards(self) -> int:
        """The number of pictures of the board that were kept."""
        return len(list(self._boards.glob("board-*.png")))

    def state(self) -> dict[str, Any]:
        """Returns everything that changes, for the page."""
        seen, info, kept = self.seen, self._info, self.kept
        return {
            "rig": self._context.rig.id,
            "camera": str(info) if info else "",
            "exposure_ms": self._exposure_ms,
            "rig_exposure_ms": self._context.rig.camera.exposure_ms,
            "fault": self._fault,
            "seen": seen.as_json() if seen else None,
            "busy": self._busy,
            "refused": self._refused,
            "notes": kept.notes if kept else "",
            "file": kept.file.name if kept else "",
            "boards": self.boards,
        }

    def _refuse_if_busy(self) -> None:
        if self._busy:
            raise UserError("A calibration is running: wait until it is done")

    # --- the camera's thread -----------------------------------------------------------------------------------------

    def run(self, stop: threading.Event) -> None:
        """Works until `stop` is set; a fault is told and tried again."""
        while not stop.is_set():
            camera: Camera | None = None
            try:
                camera = load_camera(dataclasses.replace(self._context, rig=self._rig()))
                self._watch(camera, stop)
            except UserError as error:
                self._fault = str(error)
            except Exception as error:  # whatever a driver throws, the page says it
                self._fault = f"The camera failed unexpectedly ({type(error).__name__}: {error}); it is opened again"
            finally:
                if camera is not None:
                    with contextlib.suppress(Exception):
                        camera.close()
            if self._asked is not None:
                self._calibrate(with_lens=self._asked)
            elif not self._again:
                stop.wait(RETRY_S)

    def _rig(self) -> RigConfig:
        with self._lock:
            self._again = False
            camera = dataclasses.replace(self._context.rig.camera, exposure_ms=self._exposure_ms)
            return dataclasses.replace(self._context.rig, camera=camera)

    def _watch(self, camera: Camera, stop: threading.Event) -> None:
        self._info = info = camera.open()
        watcher, last_s, due_s = Watcher(self._context.rig, info), time.monotonic(), 0.0
        while not (stop.is_set() or self._again or self._asked is not None):
            frame = camera.read(READ_S)
            now_s = time.monotonic()
            if frame is None and now_s - last_s > SILENCE_S:
                raise UserError(f"No frame from the camera for {SILENCE_S} s: check its cable")
            if frame is not None:
                last_s, self._fault = now_s, ""
                if now_s >= due_s:
                    due_s = now_s + EVERY_S
                    self._count += 1
                    self.seen = watcher.see(frame, self._count)

    def _calibrate(self, *, with_lens: bool) -> None:
        try:
            self.kept = self._calibrating(self._rig(), self._boards if with_lens else None)
        except UserError as error:
            self._refused = str(error)
        except Exception as error:  # a driver's, or OpenCV's: the page goes on, and says it
            self._refused = f"The calibration failed unexpectedly ({type(error).__name__}: {error})"
        finally:
            self._asked, self._busy = None, False
