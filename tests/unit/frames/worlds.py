"""Short sessions in the twin's own world, without frames, and what comes of them."""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from shared.bus import Received
from shared.config import Table
from shared.geometry import matrix_from_quaternion
from shared.messages import MarkerCorners, PlatformState, Sample
from shared.rig import rig_of_table
from station.app import assembly
from station.app.lockstep import Lockstep
from station.simulators.mujoco.world import TwinWorld
from tests.concealed.design import PAIRS
from tests.frames.effects import Changes
from tests.frames.rig import camera_builder, friction_of, world_builder
from tests.frames.sessions import Design, rig_toml

PAIR = "steel on steel"
MU = PAIRS[PAIR][2]


@dataclass
class Seen:
    """The messages of the bus, and the world as the session left it."""

    world: TwinWorld
    samples: list[Sample] = field(default_factory=list[Sample])
    truth_m: list[tuple[float, float]] = field(default_factory=list[tuple[float, float]])
    """The block's place at each frame."""
    corners: list[MarkerCorners] = field(default_factory=list[MarkerCorners])
    plate: list[MarkerCorners] = field(default_factory=list[MarkerCorners])
    attitude: list[PlatformState] = field(default_factory=list[PlatformState])

    @property
    def onsets_mu(self) -> list[float]:
        """tan of every onset."""
        return [math.tan(sample.onset_angle_rad) for sample in self.samples]


DESIGN = Design(
    runs=6, pair=PAIR, scatter=0.0, free=False, handled_every=1, placed_m=0.004, yaw_varies=False, dwell_s=(0.4, 0.4),
    rate_deg_s=8.0, noise_px=0.03, light=0.9,
)  # fmt: skip
FREE_M = 0.033
"""No corner of the block touches the foam within this distance of the middle."""
G, SCALE = 9.81, 6e3 / (1.0 - 10.0 / 300.0)
"""m/s²; pixels per metre where the mark is, 10 mm above the plate and 290 mm below the camera."""


def session(changes: Changes, **design: object) -> Seen:
    """A session without scatter, unless `design` says otherwise; the same runs for all changes."""
    wanted = replace(DESIGN, **design)  # pyright: ignore[reportArgumentType]
    text = rig_toml(wanted, mu_guess=0.3)
    rig = rig_of_table(Table(tomllib.loads(text), "rig.toml", text))
    lockstep = Lockstep(
        rig,
        wanted.plan(7),
        recording=None,
        camera=camera_builder(wanted, changes, pixels=False, rng=np.random.default_rng(3)),
        world=world_builder(friction_of(wanted, MU, changes), changes),
        tilter=assembly.require_reachable(rig, wanted.plan(7)),
    )
    seen = Seen(lockstep.twin.world)
    kept = {
        "session/sample": seen.samples,
        "camera/corners": seen.corners,
        "camera/plate": seen.plate,
        "arm/platform": seen.attitude,
    }

    def take(received: Received) -> None:
        if received.topic in kept:
            kept[received.topic].append(received.message)  # pyright: ignore[reportArgumentType]
        if received.topic == "camera/corners":
            seen.truth_m.append(seen.world.block_pose().position[:2])

    # Who hears everything is told first, before the session does anything about it.
    lockstep.bus.subscribe("**", take)
    outcome = lockstep.run()
    assert (outcome.samples, outcome.fault) == (wanted.runs, "")
    return seen


def gravity_at(seen: Seen, stamps_ns: NDArray[np.int64]) -> NDArray[np.float64]:
    """Gravity (n, 3) in the plate frame as the arm has it."""
    times = [one.stamp_ns for one in seen.attitude]
    down = np.array([-G * matrix_from_quaternion((a.qw, a.qx, a.qy, a.qz))[2] for a in seen.attitude])
    return np.column_stack([np.interp(stamps_ns, times, down[:, k]) for k in range(3)])


def pivot_at(seen: Seen, stamps_ns: NDArray[np.int64]) -> NDArray[np.float64]:
    """The acceleration (n, 3) of the tilts' fixed point in the plate frame, from its places at 100 Hz."""
    times = np.array([one.stamp_ns for one in seen.attitude])
    places = np.array([(one.px, one.py, one.pz) for one in seen.attitude])
    turns = np.array([matrix_from_quaternion((one.qw, one.qx, one.qy, one.qz)) for one in seen.attitude])
    gained = np.zeros_like(places)
    gained[1:-1] = (places[2:] - 2 * places[1:-1] + places[:-2]) / 0.01**2
    in_plate = np.einsum("nji,nj->ni", turns, gained)
    return np.column_stack([np.interp(stamps_ns, times, in_plate[:, k]) for k in range(3)])


def places_m(found: list[MarkerCorners]) -> NDArray[np.float64]:
    """Returns the places (n, 2), m, at which the block is seen on the plate, from the picture's middle."""
    return (np.array([one.corners_px for one in found]).reshape(-1, 4, 2).mean(axis=1) - 299.5) * (1.0, -1.0) / SCALE


def friction_and_drag(seen: Seen) -> tuple[float, float]:
    """mu and a drag (1/s) of all slides."""
    pressed, speed, missing = _resisted(seen)
    (mu, drag), *_ = np.linalg.lstsq(np.column_stack([pressed, speed]), missing, rcond=None)
    return float(mu), float(drag)


def drag_beside(mu: float, seen: Seen) -> float:
    """The drag (1/s) of all slides where friction is known: blocks of one speed alone cannot tell the two apart."""
    pressed, speed, missing = _resisted(seen)
    return float(speed @ (missing - mu * pressed) / (speed @ speed))


def _resisted(seen: Seen) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Returns of slides' frames (n,): what presses (m/s²), speed (m/s), and what the path's second difference lacks."""
    found = [one for one in seen.corners if one.found]
    stamps = np.array([one.capture_ns for one in found])
    place = places_m(found)
    step_s = 1.0 / 90.0
    velocity = (place[2:] - place[:-2]) / (2 * step_s)
    acceleration = (place[2:] - 2 * place[1:-1] + place[:-2]) / step_s**2
    speed, gravity = np.hypot(*velocity.T), gravity_at(seen, stamps[1:-1]) - pivot_at(seen, stamps[1:-1])
    # Beyond 1 m/s it is no slide but the hand; its two neighbours are not slides either.
    slides = (speed > 0.02) & (speed < 1.0) & (np.hypot(*acceleration.T) < 5.0)
    slides &= np.hypot(*place[1:-1].T) < FREE_M
    way = velocity[slides] / speed[slides, None]
    times = [one.stamp_ns for one in seen.attitude]
    wx, wy = (np.interp(stamps[1:-1], times, [getattr(one, name) for one in seen.attitude]) for name in ("wx", "wy"))
    # Coriolis presses a block on that slides as the plate tilts: mu times that would pass for a drag of 0.1 /s.
    gravity[:, 2] -= 2 * (wx * velocity[:, 1] - wy * velocity[:, 0])
    missing = ((gravity[slides, :2] - acceleration[slides]) * way).sum(axis=1)
    return -gravity[slides, 2], speed[slides], missing
