"""Runs the camera agent of a rig until Ctrl-C: camera, tracker, corners over the bus.

A fault (no camera, black picture, no marker) is said in one sentence in the log and in `camera/status`; the agent goes
on and recovers by itself when the cause is gone.
"""

from __future__ import annotations

import argparse
import signal
import threading
from types import FrameType

from pi_agent.agent import Agent
from pi_agent.calibration.store import load_calibration
from pi_agent.cameras import CameraContext, load_camera
from pi_agent.options import add_rig, rig_of
from shared.clock import SystemClock
from shared.system.processes import ENDING
from shared.zenoh_bus import ZenohBus

EXAMPLE = "pi-agent run --rig rig.toml"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options of `pi-agent run`."""
    add_rig(parser)


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
