"""Stops the arm at once, from any shell and on any system: it is held where it is until the station arms again.

This is the emergency stop of software: it asks the arm agent over the bus. It is no substitute for the red button.
"""

from __future__ import annotations

import argparse

from shared.bus_rights import OBSERVER
from shared.clock import SystemClock
from shared.messages import ArmReply, ArmStop
from shared.zenoh_bus import ZenohBus
from station.app import assembly
from station.app.asking import asked

NAME = "arm stop"
HELP = "emergency stop of the arm, over the bus"
EXAMPLE = "station arm stop --rig rig.toml"
ONE = "the arm agent did not answer: press the red button"
_ANSWER_S = 3.0
"""The time in which the agent has to be found and to answer: it takes milliseconds when it is there."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument("--rig", help="rig file; without it the simulated rig that comes with Repose")
    parser.add_argument("--reason", default="station arm stop", help="what the log and the recording say of it")


def run(options: argparse.Namespace) -> int:
    """Asks again and again until the arm agent has answered."""
    rig, clock = assembly.rig_from(options.rig), SystemClock()
    with ZenohBus.of(OBSERVER, rig, clock=clock) as bus:
        reply = asked(bus, "arm/stop", ArmStop(clock.now_ns(), options.reason), within_s=_ANSWER_S)
    if isinstance(reply, ArmReply) and reply.accepted:
        print(f"The arm of rig '{rig.id}' is stopped.")
        return 0
    print(f"The arm agent of rig '{rig.id}' did not answer within {_ANSWER_S:g} s: press the red button.")
    return 1
