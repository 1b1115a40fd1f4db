"""Live processes that hear altered messages among good ones: the sampling machine, and the arm agent with its gate.

An input is a script: at which turn of a rig made of arithmetic which payload comes on which topic. A payload goes
through `wire.decode`, as on the bus, which leaves out what is no message.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from random import Random

from shared import frames, topics, wire
from shared import messages as m
from shared.clock import SimulatedClock
from shared.errors import UserError
from shared.messages import Message
from station.rig.arm_model import load_arm_model
from station.rig.arm_settings import ArmSettings
from station.sampling.plan import DwellPlan, Plan, SlipPlan
from tests.fuzz.target import Target, Unclear
from tests.fuzz.targets.bus import changed
from tests.unit.arm.conftest import TICK_NS, FakeRig
from tests.unit.sampling.scripted_rig import GEOMETRY, START_NS, TURN_NS, ScriptedRig

Heard = list[tuple[str, Message]]
PLAN = Plan(samples=2, seed=1, dwell=DwellPlan(min_s=0.1, max_s=0.2), slip=SlipPlan(rest_timeout_s=0.3))
TURNS = 2400
"""Two runs of the scripted rig take 12 s, which are so many turns."""
TICKS = 300
"""A tilt and its return take 3 s, which are so many ticks of the arm agent."""
ARM = load_arm_model(ArmSettings().model)
ARM_START_NS = SimulatedClock().now_ns() + 20 * TICK_NS
K = ((1500.0, 0.0, 300.0), (0.0, 1500.0, 300.0), (0.0, 0.0, 1.0))


def _for_machine(random: Random, now_ns: int) -> Heard:
    """A good message of each topic that the machine hears, of this moment."""
    run, step = random.randrange(1, 3), random.randrange(-1, 8)
    corners = (270.0, 270.0, 330.0, 270.0, 330.0, 330.0, 270.0, 330.0)
    end_ns = random.choice((0, now_ns))
    return [
        ("camera/corners", m.MarkerCorners(now_ns, 9**6, corners, found=True, corner_dt_ns=(0, 0, 1, 1))),
        ("camera/geometry", GEOMETRY),
        ("camera/calibration", frames.calibration(width_px=600, height_px=600, K=K, distortion=(0.1,) * 5, stamp_ns=0)),
        ("arm/platform", m.PlatformState(now_ns, qw=math.cos(0.2), qx=math.sin(0.2))),
        ("arm/motion", m.MotionReport(now_ns, run, step, begin_ns=now_ns, end_ns=end_ns)),
        ("arm/reply", m.ArmReply(run=run, step=step, reason="no", stamp_ns=now_ns)),
        ("session/heartbeat", m.Heartbeat(now_ns, armed=True)),
        ("session/pause", m.SessionPause(now_ns, paused=random.random() < 0.5)),
        ("clock", m.ClockOffset(now_ns, random.choice(("arm", "camera")), 1000, 1000, 1000)),
        ("environment", m.Environment(now_ns, 21.0, 0.5)),
        ("arm/lease", m.ArmLease(now_ns, "me")),
    ]


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


def _script(good: Callable[[Random, int], Heard], turns: int, turn_ns: int, start_ns: int, random: Random) -> bytes:
    """Turns with payloads, most of them altered, as JSON."""
    count = random.choice((1, 3, 30, 200))
    lines = list[tuple[int, str, str]]()
    for turn in sorted(random.randrange(turns) for _ in range(count)):
        name, message = random.choice(good(random, start_ns + turn * turn_ns))
        payload = wire.encode(message) if random.random() < 0.2 else changed(random, message)
        lines.append((turn, name, payload.hex()))
    return json.dumps(lines).encode()


def _heard(path: Path) -> Iterator[tuple[int, str, Message]]:
    """The turn, topic or service, and message of every line that is a message."""
    for turn, name, payload in json.loads(path.read_bytes()):
        cls = topics.SERVICES[name].request if name in topics.SERVICES else topics.topic(name).message
        try:
            yield turn, name, wire.decode(cls, bytes.fromhex(payload))
        except UserError:
            continue


def _run_machine(path: Path) -> None:
    """A session of two runs, in which what the machine decides can be sent and obeyed."""
    rig = ScriptedRig(PLAN)
    with never_refused():
        for turn, _, message in _heard(path):
            rig.run((START_NS + turn * TURN_NS - rig.now_ns) * 1e-9)
            rig.give(message)
        rig.run(2.0)
    require_sendable([*rig.commands, *rig.events, *rig.samples])


def _run_arm(path: Path) -> None:
    """A tilt and its return, of which every set-point is a number."""
    rig = FakeRig(ArmSettings())
    rig.advance(0.2)
    sent = list[Message | None]()
    with never_refused():
        rig.command(10)
        for turn, name, message in _heard(path):
            rig.advance((ARM_START_NS + turn * TICK_NS - rig.clock.now_ns()) * 1e-9)
            if name in topics.SERVICES:
                rig.bus.request(name, message, sent.append)
            else:
                rig.bus.publish(name, message)
        rig.advance(1.0)
    require_sendable(rig.messages + [answer for answer in sent if answer])
    for target in rig.targets:
        if not all(map(math.isfinite, (*target.position_rad, *target.velocity_rad_s))):
            raise Unclear(f"the arm is sent to where nothing is: {target}")


@contextmanager
def never_refused() -> Generator[None]:
    """Turns a UserError into a finding: what comes over the network may end no process, in a sentence neither."""
    try:
        yield
    except UserError as error:
        raise Unclear(f"a message ends the process: {error}") from error


def require_sendable(sent: Iterable[Message]) -> None:
    """Raises Unclear if a message cannot be sent, or is none of its class for whoever gets it."""
    for message in sent:
        try:
            wire.decode(type(message), wire.encode(message))
        except (UserError, ValueError, TypeError) as error:
            raise Unclear(f"it sends what nobody can take: {message} ({error})") from error


_SESSIONS = partial(_script, _for_machine, TURNS, TURN_NS, START_NS)
_MOTIONS = partial(_script, _for_arm, TICKS, TICK_NS, ARM_START_NS)
TARGETS = (
    Target("live: sampling", ".json", _SESSIONS, _run_machine, share=3.0),
    Target("live: arm", ".json", _MOTIONS, _run_arm, share=3.0),
)
