"""A camera that misreads the plate's scale: the mark's own side tells it, in the errors of onsets or by a flag."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from shared.bus import Bus
from shared.messages import CameraGeometry, Message, Sample, TwinScene
from shared.rig import RigConfig
from station.app import assembly
from station.app.lockstep import Lockstep, LockstepCamera, projected_camera
from station.sampling.plan import Plan
from station.simulators.mujoco.twin import Twin

SAMPLES = 20
FREE_OF_BORDER_M = 0.03


class Misread:
    """The camera's side of the bus, on which the plate's map has another scale than the camera sees it in."""

    def __init__(self, bus: Bus, scale: float) -> None:
        self._bus, self._scale = bus, scale

    def __getattr__(self, name: str) -> Any:
        return getattr(self._bus, name)

    def publish(self, topic: str, message: Message) -> None:
        if isinstance(message, CameraGeometry):
            *rows, g, h, i = message.plate_from_pixel
            plate_from_pixel = (*(self._scale * one for one in rows), g, h, i)
            message = replace(message, plate_from_pixel=plate_from_pixel, mm_per_px=self._scale * message.mm_per_px)
        self._bus.publish(topic, message)


def session(scale: float, *, seed: int) -> tuple[list[Sample], dict[int, float], str]:
    """Returns the samples of a simulated session, the friction angle of each run's contact, and the session's fault."""
    samples: list[Sample] = []
    drawn: dict[int, float] = {}
    scenes: list[TwinScene] = []

    def camera(bus: Bus, rig: RigConfig, twin: Twin) -> LockstepCamera:
        return projected_camera(seed)(Misread(bus, scale), rig, twin)  # pyright: ignore[reportArgumentType]

    def on_scene(received: Any) -> None:
        scenes[:] = [received.message]

    def on_event(event: Any) -> None:
        if event.phase == "SLIP":
            drawn[event.run] = math.atan(scenes[0].mu)

    lockstep = Lockstep(assembly.rig_from(None), Plan(samples=SAMPLES, seed=seed), recording=None, camera=camera)
    lockstep.bus.subscribe("truth/scene", on_scene)
    lockstep.bus.subscribe("session/event", lambda got: on_event(got.message))
    lockstep.bus.subscribe("session/sample", lambda got: samples.append(got.message))  # pyright: ignore[reportArgumentType]
    fault = lockstep.run().fault
    return samples, drawn, fault


def errors(samples: list[Sample], drawn: dict[int, float], *, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns the errors (n,) of onsets that no border has touched, degrees, and over those that the samples state."""
    free = [one for one in samples if math.hypot(one.start_x_m, one.start_y_m) < scale * FREE_OF_BORDER_M]
    slid = [one for one in free if not one.censored]
    off = np.array([one.onset_angle_rad - drawn[one.run] for one in slid])
    z = off / [one.onset_sigma_rad for one in slid]
    print(
        f"scale {scale:g}: {len(slid)} onsets off by {np.degrees(np.median(off)):+.4f} degrees in the median, "
        f"{np.degrees(np.abs(off).max()):.4f} at worst; over the errors stated {np.median(z):+.2f} and "
        f"{np.abs(z).max():.2f}"
    )
    return np.degrees(off), z


@pytest.mark.parametrize("scale", [0.91, 1.05])
def test_onsets_hold_a_scale_that_the_marks_side_contradicts_in_their_errors(scale: float) -> None:
    """Their errors were 13 times those stated in the median, and 26 times at worst."""
    samples, drawn, fault = session(scale, seed=20261961)
    assert fault == ""
    assert not any(sample.disturbed for sample in samples)
    _, z = errors(samples, drawn, scale=scale)
    assert len(z) >= 5
    assert np.abs(z).max() < 3.0
    assert abs(np.median(z)) < 1.5


def test_a_scale_that_the_mark_makes_impossible_gives_no_sample_that_counts() -> None:
    samples, drawn, fault = session(1.2, seed=20261962)
    errors(samples, drawn, scale=1.2)
    assert samples
    assert all("disturbed_scale" in sample.flags for sample in samples)
    assert "the mark's side was 20% off on the plate's map" in fault
