"""Options that several commands of `pi-agent` take: the rig file, the camera in it, the board of a calibration."""

from __future__ import annotations

import argparse
import dataclasses
from pathlib import Path

from pi_agent.cameras import camera_names
from shared.config import Table
from shared.rig import RigConfig, load_rig


def add_rig(parser: argparse.ArgumentParser) -> None:
    """Declares the rig file and another driver of its camera, which `rig_of` reads."""
    parser.add_argument(
        "--rig", type=Path, default=Path("rig.toml"), metavar="FILE", help="the rig file (default: rig.toml here)"
    )
    parser.add_argument(
        "--camera", choices=camera_names(), help="the driver, in place of the rig file's [camera] driver"
    )


def add_board(parser: argparse.ArgumentParser) -> None:
    """Declares the ChArUco board, which `BoardSpec.parse` reads."""
    parser.add_argument(
        "--board", default="9x7x6", metavar="CxRxMM", help="the board: columns, rows, millimetres a square"
    )


def rig_of(options: argparse.Namespace) -> RigConfig:
    """Returns the rig file with `--camera` in it; another driver starts from its own default options.

    Raises:
        UserError: if the rig file is missing or wrong.
    """
    rig = load_rig(options.rig)
    if options.camera and options.camera != rig.camera.driver:
        none = Table({}, f"{options.rig}, whose [camera.options] are for {rig.camera.driver}, not for {options.camera}")
        camera = dataclasses.replace(rig.camera, driver=options.camera, options=none)
        rig = dataclasses.replace(rig, camera=camera)
    return rig
