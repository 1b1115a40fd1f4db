"""Runs the rig's angle sources (`[angles.<name>]` in the rig file) and publishes what they read as angle/<name>.

`station compare-angles` reads the sources itself unless this command is running; so this one is for sessions in which
the angles are recorded beside everything else, and for sensors that are plugged into another machine, whose clock must
then agree with the station's (chrony), because readings are stamped where they are taken.
"""

from __future__ import annotations

import argparse
import sys

from shared.bus_rights import OBSERVER
from shared.clock import SystemClock
from shared.system.signals import until_stopped
from shared.zenoh_bus import ZenohBus
from station.angles.instruments import Instruments
from station.app import assembly

NAME = "angles"
HELP = "read the angle sensors and publish them"
EXAMPLE = "station angles --rig rig.toml"
STOPPED = "0 once it is on the bus"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument("--rig", help="rig file; without it the simulated rig that comes with Repose")


def run(args: argparse.Namespace) -> int:
    """Runs until it is stopped."""
    rig = assembly.rig_from(args.rig)
    clock = SystemClock()
    with ZenohBus.of(OBSERVER, rig, clock=clock) as bus, until_stopped() as stopped:
        instruments = Instruments(bus, rig.angles, clock=clock)
        bus.announce(NAME)
        print(f"The angle sources of rig '{rig.id}' are read: {', '.join(instruments.names)}.", flush=True)
        try:
            while not stopped.is_set():
                bus.poll(0.005)
                for note in instruments.tick():
                    print(note.text, file=sys.stderr, flush=True)
        finally:
            instruments.close()
    return 0
