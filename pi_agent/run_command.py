"""Runs the camera agent of a rig until Ctrl-C: camera, tracker, corners over the bus.

A fault (no camera, black picture, no marker) is said in one sentence in the log and in `camera/status`; the agent goes
on and recovers by itself when the cause is gone.
"""

from __future__ import annotations

import argparse
import dataclasses
import signal
import threading
from pathlib import Path
from types import FrameType

from pi_agent.agent import Agent
from pi_agent.calibration.store import load_calibration
from pi_agent.cameras import CameraContext, camera_names, load_camera
from shared.clock import SystemClock
from shared.config import Table
from shared.rig import RigConfig, load_rig
from shared.system.processes import ENDING
from shared.zenoh_bus import ZenohBus


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `pi-agent run`."""
    parser.add_argument(
        "--rig", type=Path, default=Path("rig.toml"), metavar="FILE", help="the rig file (default: rig.toml here)"
    )
    parser.add_argument(
        "--camera", choices=camera_names(), help="the driver, in place of the rig file's [camera] driver"
    )
    parser.set_defaults(action=run)


def rig_of(options: argparse.Namespace) -> RigConfig:
    """The rig file with `--camera` in it; another driver starts from its own default options.

    Raises:
        UserError: if the rig file is missing or wrong.
    """
    rig = load_rig(options.rig)
    if options.camera and options.camera != rig.camera.driver:
        none = Table({}, f"{options.rig}, whose [camera.options] are for {rig.camera.driver}, not for {options.camera}")
        camera = dataclasses.replace(rig.camera, driver=options.camera, options=none)
        rig = dataclasses.replace(rig, camera=camera)
    return rig


def run(options: argparse.Namespace) -> int:
    """Runs the agent until Ctrl-C, or another program asks it to end.

    Raises:
        UserError: if the rig file is wrong or its endpoint cannot be listened on.
    """
    rig, clock, folder = rig_of(options), SystemClock(), options.rig.parent
    calibration = load_calibration(folder / rig.camera.calibration) if rig.camera.calibration else None
    stop = stop_on_signals()
    with ZenohBus.of("camera", rig, clock=clock) as bus:
        camera = load_camera(CameraContext(rig=rig, bus=bus, clock=clock, folder=folder))
        Agent(rig, camera, bus, clock, calibration=calibration).run(stop)
    return 0


def stop_on_signals() -> threading.Event:
    """An event that is set by Ctrl-C, and when another program asks this one to end."""
    stop = threading.Event()

    def on_signal(number: int, frame: FrameType | None) -> None:
        del number, frame
        stop.set()

    for number in ENDING:
        signal.signal(number, on_signal)
    return stop
