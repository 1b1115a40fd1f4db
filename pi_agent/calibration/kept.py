"""Calibrates the camera of a rig, and keeps the result beside the rig file: for the command and for the page."""

from __future__ import annotations

import dataclasses
import time
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from pi_agent.calibration.lens import BoardSpec, Lens, calibrate_lens
from pi_agent.calibration.picture import draw
from pi_agent.calibration.session import calibrate
from pi_agent.calibration.store import write_calibration
from pi_agent.cameras import CameraContext, load_camera
from pi_agent.cameras.video_file import open_pictures
from shared.errors import UserError
from shared.rig import RigConfig


@dataclass(frozen=True)
class Kept:
    """A calibration that was written: its file, the picture of it, and the findings in words."""

    file: Path
    picture: Path
    notes: str


def lens_of(folder: Path | None, board: BoardSpec) -> Lens | None:
    """Returns the lens by a folder's pictures of the board; none without a folder.

    Raises:
        UserError: if the pictures do not tell it.
    """
    if folder is None:
        return None
    pictures, _ = open_pictures(folder, setting="--lens")
    return calibrate_lens((picture() for picture in pictures), board)


def calibrate_and_keep(
    context: CameraContext, file: Path, *, lens: Lens | None, frames: int, with_tone: bool = True
) -> Kept:
    """Calibrates the camera and writes the result, with a picture of it beside it.

    Raises:
        UserError: when the calibration is bad, and nothing is written, or when it cannot be written.
    """
    rig = context.rig
    result = calibrate(
        rig,
        lambda exposure_ms: load_camera(_exposed(context, exposure_ms)),
        lens=lens,
        frames=frames,
        rng=np.random.default_rng(0),
        with_tone=with_tone,
        source=file.name,
    )
    picture = file.with_suffix(".png")
    try:
        write_calibration(result.calibration, file, notes=_heading(rig) + result.notes)
    except OSError as error:
        raise UserError(f"Expected to write {file}, but that failed: {error.strerror}") from error
    cv2.imwrite(str(picture), draw(result, rig))
    return Kept(file, picture, result.notes)


def _heading(rig: RigConfig) -> str:
    when = time.strftime("%Y-%m-%d %H:%M:%S", time.gmtime())
    return f"Calibration of the camera ({rig.camera.driver}) of rig {rig.id}, {when} UTC, by pi-agent.\n"


def _exposed(context: CameraContext, exposure_ms: float) -> CameraContext:
    camera = dataclasses.replace(context.rig.camera, exposure_ms=exposure_ms)
    return dataclasses.replace(context, rig=dataclasses.replace(context.rig, camera=camera))
