"""Runs the simulated rig's world: a MuJoCo arm, plate and block that speak on the bus as the real ones do."""

from __future__ import annotations

import argparse
import math

from shared.arguments import seed_of
from shared.clock import SystemClock
from shared.errors import UserError
from shared.system.signals import until_stopped
from shared.zenoh_bus import ZenohBus
from station.app import assembly
from station.app.processes import paced
from station.simulators.mujoco.twin import Twin

NAME = "twin"
HELP = "simulate arm, plate and block (MuJoCo) on the bus"
EXAMPLE = "station twin --rig rig.toml"
STOPPED = "0 once it is on the bus"
SCENES_A_FRAME = 2
"""The synthetic camera takes its frames at the moments of scenes, so their rate is a multiple of the camera's."""

LEAST_HZ = 100.0
"""The rate of arm/joints and arm/platform, whose readings the twin's joints are, whatever the camera's rate is."""


def tick_rate_hz(camera_hz: float) -> float:
    """Returns the rate at which the twin is asked: a multiple of the scenes' rate that is enough for the arm agent."""
    scenes_hz = SCENES_A_FRAME * camera_hz
    return scenes_hz * math.ceil(LEAST_HZ / scenes_hz)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument("--rig", help="rig file; without it the simulated rig that comes with Repose")
    parser.add_argument("--seed", type=seed_of, default=1, help="seed of the friction's scatter")


def run(options: argparse.Namespace) -> int:
    """Runs until it is stopped."""
    rig = assembly.rig_from(options.rig)
    if not rig.bus.twin:
        raise UserError('Expected an endpoint for the twin in the rig file, e.g. [bus] twin = "tcp/127.0.0.1:7449"')
    clock = SystemClock()
    with ZenohBus.of("twin", rig, clock=clock) as bus:
        world = assembly.twin_world(rig, seed=options.seed, start_ns=clock.now_ns())
        twin = Twin(bus, world)
        with until_stopped() as stopped:
            print(f"The twin of rig '{rig.id}' is on the bus at {rig.bus.twin}.", flush=True)
            for now_ns in paced(clock, bus, rate_hz=tick_rate_hz(rig.camera.rate_hz), stopped=stopped):
                twin.tick(now_ns)
    return 0
