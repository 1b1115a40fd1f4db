from __future__ import annotations

import math
from collections import Counter
from importlib.metadata import entry_points

import pytest

from pi_agent.lockstep import PixelCamera
from shared import wire
from shared.bus import Received
from shared.clock import SimulatedClock
from shared.errors import UserError
from shared.geometry import block_pose_of
from shared.memory_bus import MemoryBus
from shared.messages import CameraGeometry, MarkerCorners
from tests.unit.pi_agent.rigs import rig, scene

FRAME_NS = 11_111_111


def session(*, seed: int = 3, count: int = 100) -> list[Received]:
    clock = SimulatedClock()
    bus = MemoryBus(clock)
    seen: list[Received] = []
    bus.subscribe("**", seen.append)
    camera = PixelCamera(bus, rig(options={"sag_px": 6.0}), seed=seed)
    for number in range(count):
        now_ns = clock.now_ns() + FRAME_NS
        clock.advance_to(now_ns)
        x_m = 0.01 * math.sin(0.05 * number)
        camera.tick(now_ns, scene(x_m, 0.002, 0.1, stamp_ns=now_ns))
    return seen


def test_it_says_what_the_agent_says_at_the_agents_rates():
    seen = session()
    count = Counter(received.topic for received in seen)
    assert count["camera/corners"] == 100
    assert count["camera/plate"] == pytest.approx(4 * 15 * 100 / 90, abs=4)
    assert count["camera/image"] == count["camera/image/overlay"] == pytest.approx(12 * 100 / 90, abs=2)
    assert count["camera/status"] == count["camera/geometry"] == count["camera/calibration"] == 2
    geometry = next(r.message for r in seen if r.topic == "camera/geometry")
    reports = [r.message for r in seen if r.topic == "camera/corners"]
    assert isinstance(geometry, CameraGeometry)
    for number, report in enumerate(reports):
        assert isinstance(report, MarkerCorners)
        assert report.found
        x, y, _ = block_pose_of(report.corners_px, geometry)
        assert (x, y) == pytest.approx((0.01 * math.sin(0.05 * number), 0.002), abs=4e-5)


def test_the_same_seed_gives_the_same_bytes():
    first, second, other = (session(seed=seed, count=20) for seed in (5, 5, 6))
    payloads = [[(r.topic, wire.encode(r.message)) for r in seen] for seen in (first, second, other)]
    assert payloads[0] == payloads[1]
    assert payloads[0] != payloads[2]


def test_the_package_says_where_it_is():
    found = entry_points(group="repose.lockstep_camera", name="synthetic")
    if not found:
        pytest.skip("the installed package is older than its entry point: `make setup` installs it anew")
    assert next(iter(found)).load() is PixelCamera


def test_another_drivers_options_are_refused():
    with pytest.raises(UserError, match="path"):
        PixelCamera(MemoryBus(SimulatedClock()), rig(options={"path": "v.mp4"}), seed=1)
