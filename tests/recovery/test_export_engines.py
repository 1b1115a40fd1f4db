"""The exported files in the engines: the tilt test there gives the measured angle, direction by direction.

An engine that is not installed is skipped (MuJoCo always is). What an engine is known to get wrong is held to its size,
so that the sentences in the files stay true.
"""

from __future__ import annotations

import importlib.util
import math
import re
from pathlib import Path

import numpy as np
import pytest

from station.export.measured import MeasuredPair
from station.export.unsupported import pyramid_excess_rad
from tests.recovery.engines import Engine, engines
from tests.recovery.engines.tilt import onset
from tests.unit.export.pairs import PAIRS, STEEL_ON_WOOD, WOOD_ON_STEEL, WOOD_ON_WOOD, exported

ENGINES = engines()
WITHIN_DEG = {"MuJoCo": 0.05, "Drake": 0.15, "Bullet": 0.6, "Bullet, 240 Hz": 1.0, "DART": 0.02, "PhysX": 0.05}
DIRECTIONS = {"MuJoCo": 24, "Drake": 4, "Bullet": 12, "Bullet, 240 Hz": 12, "DART": 4, "PhysX": 2}
CASES = [
    (name, stem)
    for name, engine in sorted(ENGINES.items())
    for stem, pair in PAIRS.items()
    if pair.isotropic or engine.ANISOTROPIC
]


def installed(name: str) -> Engine:
    """The engine, or a skipped test."""
    engine = ENGINES[name]
    if importlib.util.find_spec(engine.MODULE) is None:
        pytest.skip(f"{name} is not installed ({engine.MODULE})")
    return engine


def off_deg(engine: Engine, folder: Path, stem: str, direction: float, *, object_yaw_rad: float = 0.0) -> float:
    """Returns how much later than measured the object starts towards a direction (from x of the measured body)."""
    expected = float(PAIRS[stem].angle_rad(direction))
    bench = engine.load(folder, stem, object_yaw_rad=object_yaw_rad)
    # The bench pulls along the world's axes, the object has been turned against them.
    turned = object_yaw_rad if PAIRS[stem].fixed_in == "object" else 0.0
    try:
        seen = onset(bench, direction + turned, expected_rad=expected)
    finally:
        bench.close()
    return math.degrees(seen.angle_rad - expected)


def circle(count: int) -> list[float]:
    """Directions that are not the axes alone."""
    return [float(each) for each in np.arange(count) * (2 * math.pi / count)]


@pytest.mark.parametrize(("name", "stem"), CASES)
def test_the_tilt_test_gives_the_measured_angle(name: str, stem: str, tmp_path: Path):
    engine = installed(name)
    folder = exported(tmp_path, engine.FORMAT)
    off = [off_deg(engine, folder, stem, direction) for direction in circle(DIRECTIONS[name])]
    assert np.abs(off).max() < WITHIN_DEG[name], np.round(off, 2)


@pytest.mark.parametrize("yaw_deg", [40.0, 100.0])
def test_bullets_ellipse_turns_with_the_object_and_stays_with_the_plate(yaw_deg: float, tmp_path: Path):
    engine = installed("Bullet")
    folder = exported(tmp_path, engine.FORMAT)
    for stem in ("wood_on_wood", "wood_on_steel"):
        off = [
            off_deg(engine, folder, stem, direction, object_yaw_rad=math.radians(yaw_deg)) for direction in circle(6)
        ]
        # A friction anchor of the multiplied tangents makes it start up to a degree early on a turned object.
        assert np.abs(off).max() < 1.2, np.round(off, 2)


def test_without_the_turn_of_the_plate_mujoco_is_off_by_degrees(tmp_path: Path):
    engine = installed("MuJoCo")
    folder = exported(tmp_path, engine.FORMAT)
    path = folder / "wood_on_steel.mjcf.xml"
    path.write_text(re.sub(r'(<body name="plate") quat="[^"]*"', r"\1", path.read_text("utf-8")), encoding="utf-8")
    off = [off_deg(engine, folder, "wood_on_steel", direction) for direction in circle(8)]
    assert np.abs(off).max() > 5


def test_a_pyramid_is_late_between_its_axes_by_what_the_file_says(tmp_path: Path):
    engine = installed("DART")
    folder = exported(tmp_path, engine.FORMAT)
    worst = math.degrees(pyramid_excess_rad(STEEL_ON_WOOD))
    assert off_deg(engine, folder, "steel_on_wood", math.radians(45)) == pytest.approx(worst, abs=0.05)
    said = f"starts up to {worst:.1f} degrees too late"
    assert said in " ".join((folder / "steel_on_wood.gazebo.sdf").read_text("utf-8").split())


@pytest.mark.parametrize("pair", [WOOD_ON_STEEL, WOOD_ON_WOOD])
def test_a_pyramid_of_an_ellipse_lets_go_at_its_edges(pair: MeasuredPair):
    phi = np.linspace(0, 2 * math.pi, 3601)
    one, two = np.abs(np.cos(phi - pair.axis_rad)), np.abs(np.sin(phi - pair.axis_rad))
    # The force at which the first of both components is used up, found by trying.
    force = np.array(
        [
            next(f for f in np.arange(0.2, 1.2, 1e-3) if f * a > pair.mu_1 or f * b > pair.mu_2)
            for a, b in zip(one[::10], two[::10], strict=True)
        ]
    )
    worst = float((np.arctan(force) - pair.angle_rad(phi[::10])).max())
    assert pyramid_excess_rad(pair) == pytest.approx(worst, abs=math.radians(0.1))
