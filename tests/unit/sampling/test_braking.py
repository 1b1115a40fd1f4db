"""The friction that brakes blocks which slide by their own weight, and those which are pushed."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable

import numpy as np
import pytest
from numpy.random import default_rng

from station.friction.onset_loads import GRAVITY_M_S2
from station.rig.opening import Opening, square_corners
from station.sampling import braking
from station.sampling.braking import before_foam, pushed
from station.sampling.no_slide import Seen

HZ = 90.0
SUBSTEPS = 20
REST_S = 1.0
NOISE_M = 4e-6
DOWN = np.array([0.0, -1.0])

Law = Callable[[float, float], float]
"""The friction of a block by its speed, m/s, and its way, m."""


def turned(time_s: float, *, top_rad: float) -> float:
    """Returns the tilt of a plate that is tilted at 5 degrees/s up to `top_rad`, at REST_S + 0.3 s, and back at 20."""
    after_s = time_s - REST_S - 0.3
    return top_rad + math.radians(5.0 * after_s if after_s < 0.0 else -20.0 * after_s)


def path(law: Law, *, top_deg: float, push: Callable[[float], float] | None = None, seed: int = 1) -> Seen:
    """Returns the path of a block with a law of friction, until the plate is level; a hand gives it a speed, m/s.

    It is at rest on the plate, or pushed, until REST_S.
    """
    step_s, top_rad = 1.0 / (HZ * SUBSTEPS), math.radians(top_deg)
    end_s = REST_S + 0.3 + top_deg / 20.0
    place, speed, places, tilts = 0.0, 0.0, list[float](), list[float]()
    for k in range(round(end_s * HZ) * SUBSTEPS):
        time_s = k * step_s
        tilt = turned(time_s, top_rad=top_rad)
        if k % SUBSTEPS == 0:
            places.append(place)
            tilts.append(tilt)
        held = push is None and time_s < REST_S
        pull = GRAVITY_M_S2 * (math.sin(tilt) - law(speed, place) * math.cos(tilt))
        speed = 0.0 if held else max(speed + pull * step_s, push(time_s) if push else 0.0, 0.0)
        place += speed * step_s
    length = np.array(places)
    noise = NOISE_M * default_rng(seed).normal(size=(len(length), 2))
    time_ns = np.round(np.arange(len(length)) / HZ * 1e9).astype(np.int64)
    return Seen(time_ns, np.outer(length, DOWN) + noise, np.array(tilts))


def told(seen: Seen) -> bool:
    return pushed(seen, since=round(0.9 * HZ))


def drops(mu_k: float) -> Law:
    return lambda _speed, _way: mu_k


def strengthens(_speed: float, _way: float) -> float:
    """Returns a friction that begins with 0.25 and grows by 0.03 with each e-fold of speed beyond 1 mm/s."""
    return 0.25 + 0.03 * math.log(max(_speed, 1e-3) / 1e-3)


TOP_DEG = 20.0
"""A block with this friction angle, or a bit less, breaks free at 18.5 degrees, when the plate goes on to 20."""
STATIC = math.tan(math.radians(18.5))


@pytest.mark.parametrize("law", [drops(STATIC), drops(0.8 * STATIC), drops(0.3 * STATIC), strengthens])
def test_a_block_that_slides_by_its_weight_is_braked_by_no_more_than_held_it(law: Law) -> None:
    """It comes to rest on a plate that is tilted back, or slides until that is level."""
    assert not told(path(law, top_deg=TOP_DEG))


def test_noise_brakes_no_block() -> None:
    assert not any(told(path(drops(STATIC), top_deg=TOP_DEG, seed=seed)) for seed in range(100))


@pytest.mark.parametrize("frame", range(100, 126))
def test_a_frame_that_is_misread_brakes_no_block(frame: int) -> None:
    """It is off by two pixels, up or down the plate."""
    for off_m in (-3.4e-4, 3.4e-4):
        seen = path(drops(STATIC), top_deg=TOP_DEG)
        seen.place_m[frame] += off_m * DOWN
        assert not told(seen)


@pytest.mark.parametrize(("speed_m_s", "for_s"), [(0.04, 0.15), (0.05, 0.12), (0.15, 0.01)])
@pytest.mark.parametrize("top_deg", [6.0, 9.0])
def test_a_block_that_is_pushed_is_braked_by_more(speed_m_s: float, for_s: float, top_deg: float) -> None:
    """Its friction would hold it up to 22 degrees."""

    def push(time_s: float) -> float:
        return speed_m_s if 0.0 <= time_s - REST_S < for_s else 0.0

    assert told(path(drops(math.tan(math.radians(22.0))), top_deg=top_deg, push=push))


def test_longer_stretches_tell_pushes_that_noise_hides(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.modules[__name__], "NOISE_M", 10.0 * NOISE_M)
    law = drops(math.tan(math.radians(22.0)))
    pushes = [
        path(law, top_deg=top, push=lambda time_s, of=one: of[0] if 0.0 <= time_s - REST_S < of[1] else 0.0, seed=seed)
        for seed in range(10)
        for one in [(0.05, 0.12), (0.15, 0.01)]
        for top in (6.0, 9.0, 13.0)
    ]
    long = sum(map(told, pushes))
    monkeypatch.setattr(braking, "_FRAMES", 2)
    assert sum(map(told, pushes)) < long > 0.8 * len(pushes)


def test_a_block_that_hops_on_a_tapped_plate_is_braked_by_more() -> None:
    """Hops of 0.4 mm, five a second."""

    def push(time_s: float) -> float:
        return 0.045 if time_s >= REST_S and (time_s - REST_S) % 0.2 < 0.006 else 0.0

    assert told(path(drops(math.tan(math.radians(22.0))), top_deg=9.0, push=push))


@pytest.mark.parametrize("rougher", [1.1, 1.4])
def test_friction_that_differs_from_place_to_place_is_no_push(rougher: float) -> None:
    """The plate has more friction beyond an edge, over which a sole of 16 mm comes by and by."""
    more = rougher * math.tan(math.radians(TOP_DEG)) - STATIC
    assert not told(path(lambda _, way: STATIC + more * min(way / 0.016, 1.0), top_deg=TOP_DEG))


def uneven(sd: float, reach_m: float, seed: int) -> Law:
    """Returns a friction that wanders along the way by `sd` of it, over `reach_m`."""
    rng = default_rng(seed)
    waves = list(zip(rng.normal(0.0, 1.0 / reach_m, 12), rng.uniform(0.0, 2.0 * math.pi, 12), strict=True))

    def friction(_speed: float, way: float) -> float:
        return STATIC * (1.0 + sd * math.sqrt(2.0 / 12) * sum(math.cos(k * way + phase) for k, phase in waves))

    return friction


@pytest.mark.parametrize(("sd", "reach_m"), [(0.02, 0.004), (0.05, 0.001), (0.05, 0.004), (0.1, 0.01)])
def test_no_slide_on_an_uneven_plate_is_a_push(sd: float, reach_m: float) -> None:
    """None of 120 in all: fewer than 3 % are, in 95 of 100 tests like this."""
    assert not any(told(path(uneven(sd, reach_m, seed), top_deg=TOP_DEG, seed=seed)) for seed in range(30))


def test_frames_in_which_the_block_may_have_come_to_the_foam_are_left_out() -> None:
    seen = path(drops(0.5 * STATIC), top_deg=TOP_DEG)
    outline = np.concatenate([square_corners(0.005, (float(x), float(y), 0.0)) for x, y in seen.place_m])
    count = before_foam(seen, outline, Opening(radius_m=0.045), down=DOWN)
    way = -seen.place_m[:, 1]
    # The block's edge has 40 mm to the foam's nominal edge.
    assert 0.008 < way[count - 1] < way[count] < 0.027
    assert before_foam(seen.first(1), outline[:1], Opening(radius_m=0.045), down=DOWN) == 0
