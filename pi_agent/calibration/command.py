"""Measures the camera of a rig, and keeps the result beside the rig file.

The plate is level and at rest, the block lies in its middle, nothing hides the fiducials in its corners. Measured are
the lens (from pictures of a ChArUco board), the map from pixels to the plate, the tone curve, the noise, the scatter of
a resting corner, and what each exposure costs in motion blur. A bad calibration is refused and nothing is written.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import cv2

from pi_agent.calibration.kept import calibrate_and_keep, lens_of
from pi_agent.calibration.lens import BoardSpec
from pi_agent.calibration.session import take
from pi_agent.cameras import Camera, CameraContext, load_camera
from pi_agent.options import add_board, add_rig, rig_of
from shared.clock import SystemClock
from shared.errors import UserError
from shared.zenoh_bus import ZenohBus

EXAMPLE = "pi-agent calibrate --rig rig.toml"
FEWEST_FRAMES = 30
SHOT_S = 2.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options of `pi-agent calibrate`."""
    add_rig(parser)
    add_board(parser)
    add = parser.add_argument
    add("--out", default="calibration.toml", metavar="NAME", help="the result's name in the rig file's folder")
    add("--frames", type=int, default=120, metavar="N", help="frames for the scatter of a corner")
    add("--no-tone", action="store_true", help="leave the tone curve as the driver says")
    add("--lens", type=Path, metavar="FOLDER", help="pictures of the ChArUco board, for focal length and distortion")
    add("--take", type=int, metavar="N", help=f"take N pictures for --lens, one every {SHOT_S:g} s, and end")
    add("--print-board", type=Path, metavar="FILE.png", help="write the board, to be printed, and end")


def run(options: argparse.Namespace) -> int:
    """Calibrates, or prepares it.

    Raises:
        UserError: when something is missing or the calibration is bad.
    """
    board = BoardSpec.parse(options.board)
    if options.print_board:
        return _print_board(board, options.print_board)
    if options.take and not options.lens:
        raise UserError("Expected --lens FOLDER for the pictures that --take takes, got none")
    if options.frames < FEWEST_FRAMES:
        raise UserError(f"Expected at least {FEWEST_FRAMES} --frames, got {options.frames}")
    rig, clock, folder = rig_of(options), SystemClock(), options.rig.parent
    lens = None if options.take else lens_of(options.lens, board)
    with ZenohBus.of("camera", rig, clock=clock) as bus:
        context = CameraContext(rig=rig, bus=bus, clock=clock, folder=folder)
        if options.take:
            return _take_pictures(load_camera(context), options.lens, options.take)
        kept = calibrate_and_keep(
            context, folder / options.out, lens=lens, frames=options.frames, with_tone=not options.no_tone
        )
    print(f"{kept.notes}\nWritten to {kept.file}; look at {kept.picture}.")
    if rig.camera.calibration != options.out:
        print(f'To use it: put calibration = "{options.out}" under [camera] in {options.rig}.')
    return 0


def _print_board(board: BoardSpec, file: Path) -> int:
    if not cv2.imwrite(str(file), board.picture()):
        raise UserError(f"Expected to write a picture to {file}, but OpenCV cannot: does the folder exist?")
    width, height = board.columns * board.square_mm, board.rows * board.square_mm
    print(f"{file}: print it so that the chessboard measures {width:g} x {height:g} mm, and glue it to something flat.")
    return 0


def _take_pictures(camera: Camera, folder: Path, count: int) -> int:
    folder.mkdir(parents=True, exist_ok=True)
    print(f"Hold the board at many places and tilts; a picture every {SHOT_S:g} s.")
    for number in range(count):
        time.sleep(SHOT_S)
        shot = take(camera, count=1)
        cv2.imwrite(str(folder / f"board-{number:03d}.png"), shot.frames[0])
        print(f"  {number + 1} of {count}")
    return 0
