"""Runs the arm agent: one driver on the bus, behind the safety gate, which works on when the station is gone."""

from __future__ import annotations

import argparse

from shared.clock import SystemClock
from shared.zenoh_bus import ZenohBus
from station.app import assembly
from station.arm import loop
from station.arm.agent import arm_agent
from station.arm.kept import kept
from station.rig.tilt import DIRECTIONS, azimuth_of_direction

NAME = "arm"
HELP = "run the arm agent: driver and safety gate on the bus"
EXAMPLE = "station arm --rig rig.toml"
STOPPED = "0 once it is on the bus"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument("--rig", help="rig file; without it the simulated rig that comes with Repose")


def run(options: argparse.Namespace) -> int:
    """Runs until it is stopped; the arm is then held where it is."""
    rig = assembly.rig_from(options.rig)
    settings = assembly.arm_settings(rig)
    clock, requests = SystemClock(), loop.Requests()
    with ZenohBus.of("arm", rig, clock=clock) as bus:
        before = kept(rig.id)
        agent = arm_agent(bus, settings, kept=before)
        for direction in range(DIRECTIONS):  # solved now, not in the middle of the first tick that needs it
            agent.tilter.path(azimuth_of_direction(direction))
        with loop.signals(requests):
            print(f"The arm agent of rig '{rig.id}' ({settings.driver}) is on the bus at {rig.bus.arm}.", flush=True)
            if stopped := before.stop.read():
                print(f"The arm is stopped ({stopped}) until a session is started.", flush=True)
            loop.run(agent, bus=bus, clock=clock, requests=requests)
    return 0
