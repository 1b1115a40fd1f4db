"""The synthetic camera's frames go forward, also where the twin's scenes come late."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from pi_agent.cameras import CameraContext
from pi_agent.cameras.synthetic import SyntheticCamera
from shared.clock import SystemClock
from shared.memory_bus import MemoryBus
from tests.unit.pi_agent.rigs import FakeTwin, rig, scene


def test_a_scene_that_was_drawn_is_not_the_moment_of_the_next_frame(tmp_path: Path) -> None:
    """A busy twin has no newer one: two frames had one moment, as if the camera had repeated a picture."""
    clock = SystemClock()
    bus = MemoryBus(clock)
    camera = SyntheticCamera(CameraContext(rig=rig(driver="synthetic"), bus=bus, clock=clock, folder=tmp_path))
    with FakeTwin(bus, clock):
        period_ns = round(1e9 / camera.open().rate_hz)
        frame = camera.read(5.0)
    assert frame is not None
    moment_of = camera._moment_of  # pyright: ignore[reportPrivateUsage]
    drawn = replace(scene(0.0, 0.0, 0.0), stamp_ns=frame.capture_ns)
    for late in (0.3, 0.6):
        due_ns = frame.capture_ns + round(late * period_ns)
        assert moment_of(drawn, due_ns) == due_ns
    assert moment_of(replace(drawn, stamp_ns=due_ns + 5), due_ns) == due_ns + 5
    assert moment_of(drawn, frame.capture_ns - 7) == frame.capture_ns + 1
