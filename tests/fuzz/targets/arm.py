"""The arm agent with its gate, which hears altered messages among good ones."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path
from random import Random

from shared import messages as m
from shared import topics
from shared.clock import SimulatedClock
from shared.messages import Message
from station.rig.arm_model import load_arm_model
from station.rig.arm_settings import ArmSettings
from tests.fuzz.heard import Heard, heard, never_refused, require_sendable, script
from tests.fuzz.target import Target, Unclear
from tests.unit.arm.conftest import TICK_NS, FakeRig

TICKS = 300
"""A tilt and its return take 3 s, which are so many ticks of the arm agent."""
ARM = load_arm_model(ArmSettings().model)
ARM_START_NS = SimulatedClock().now_ns() + 20 * TICK_NS


def _for_arm(random: Random, now_ns: int) -> Heard:
    """A good message of each topic and service that the arm agent hears, of this moment."""
    owner = random.choice(("", "me"))
    direction, azimuth_rad = random.choice(((0, 0.0), (2, math.pi), (-1, 0.0)))
    angle_rad = random.choice((0.0, 0.1, 0.3))
    command = m.TiltCommand(now_ns, 1, direction, azimuth_rad, angle_rad, 1, 0.2, owner)
    return [
        ("arm/command", command),
        ("arm/command", command),
        ("arm/lease", m.LeaseRequest(now_ns, owner, take_over=random.random() < 0.5)),
        ("arm/stop", m.ArmStop(now_ns, "a stop")),
        ("session/heartbeat", m.Heartbeat(now_ns, random.random() < 0.5, owner)),
        ("twin/joints", m.JointState(now_ns, ARM.joint_names, ARM.home_rad, (0.0,) * len(ARM.home_rad))),
    ]


def _run_arm(path: Path) -> None:
    """A tilt and its return, of which every set-point is a number."""
    rig = FakeRig(ArmSettings())
    rig.advance(0.2)
    sent, given = list[Message | None](), list[Message]()
    with never_refused():
        rig.command(10)
        for turn, name, message in heard(path):
            rig.advance((ARM_START_NS + turn * TICK_NS - rig.clock.now_ns()) * 1e-9)
            if name in topics.SERVICES:
                rig.bus.request(name, message, sent.append)
            else:
                given.append(message)
                rig.bus.publish(name, message)
        rig.advance(1.0)
    # All that is on the bus is heard, the script's own too: its payloads need not be what `wire.encode` makes.
    others = [message for message in rig.messages if not any(message is one for one in given)]
    require_sendable(others + [answer for answer in sent if answer])
    for target in rig.targets:
        if not all(map(math.isfinite, (*target.position_rad, *target.velocity_rad_s))):
            raise Unclear(f"the arm is sent to where nothing is: {target}")


_MOTIONS = partial(script, _for_arm, TICKS, TICK_NS, ARM_START_NS)
TARGETS = (Target("live: arm", ".json", _MOTIONS, _run_arm, share=3.0),)
