"""Runs the camera agent of a rig until Ctrl-C: camera, tracker, corners over the bus.

A fault (no camera, black picture, no marker) is said in one sentence in the log and in `camera/status`; the agent goes
on and recovers by itself when the cause is gone.
"""

from __future__ import annotations

import argparse

from pi_agent.agent import Agent
from pi_agent.calibration.store import load_calibration
from pi_agent.cameras import CameraContext, load_camera
from pi_agent.options import add_rig, rig_of
from shared.clock import SystemClock
from shared.system.signals import until_stopped
from shared.zenoh_bus import ZenohBus

EXAMPLE = "pi-agent run --rig rig.toml"
STOPPED = "0 once it runs"


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
    with until_stopped() as stop, ZenohBus.of("camera", rig, clock=clock) as bus:
        camera = load_camera(CameraContext(rig=rig, bus=bus, clock=clock, folder=folder))
        Agent(rig, camera, bus, clock, calibration=calibration).run(stop)
    return 0
