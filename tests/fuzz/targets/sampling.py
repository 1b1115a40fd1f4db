"""The sampling machine, which hears altered messages among good ones."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path
from random import Random

from shared import frames
from shared import messages as m
from station.sampling.plan import DwellPlan, Plan, SlipPlan
from tests.fuzz.heard import Heard, heard, never_refused, require_sendable, script
from tests.fuzz.target import Target
from tests.unit.sampling.scripted_rig import GEOMETRY, START_NS, TURN_NS, ScriptedRig

PLAN = Plan(samples=2, seed=1, dwell=DwellPlan(min_s=0.1, max_s=0.2), slip=SlipPlan(rest_timeout_s=0.3))
TURNS = 2400
"""Two runs of the scripted rig take 12 s, which are so many turns."""
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


def _run_machine(path: Path) -> None:
    """A session of two runs, in which what the machine decides can be sent and obeyed."""
    rig = ScriptedRig(PLAN)
    with never_refused():
        for turn, _, message in heard(path):
            rig.run((START_NS + turn * TURN_NS - rig.now_ns) * 1e-9)
            rig.give(message)
        rig.run(2.0)
    require_sendable([*rig.commands, *rig.events, *rig.samples])


_SESSIONS = partial(script, _for_machine, TURNS, TURN_NS, START_NS)
TARGETS = (Target("live: sampling", ".json", _SESSIONS, _run_machine, share=3.0),)
