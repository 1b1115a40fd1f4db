"""Exported models in their engines: the block slides as in our own simulation, in a Python that has no Repose.

An engine that is not installed is skipped (NumPy and MuJoCo always are).
"""

from __future__ import annotations

import importlib.util
import math
from pathlib import Path

import numpy as np
import pytest

from station.export import export_model, model_formats
from station.export.carried.states import contact
from station.export.deviation import Deviation, deviations
from station.export.from_model import NamedModel
from station.physics.model import Model
from tests.recovery.engines import engines
from tests.recovery.engines.tilt import onset
from tests.unit.export.models import CREEPS, TEXTS, TURNS, file_of, model_of

MODULES = {"numpy": "numpy", "mujoco-python": "mujoco", "pybullet": "pybullet", "drake": "pydrake"}
WITHIN_DEG = {"numpy": 0.005, "mujoco-python": 0.01, "pybullet": 0.03, "drake": 0.02}
"""Of the tilt at 2°/s when the block has gone 0.1 mm. A step of 1 ms is 0.002°. MuJoCo reads each friction one step
late. Bullet's solver stops after 50 rounds. Drake's friction is full at 10 µm/s alone: until it slides, the block
creeps by 10 µm a second, a tenth of the way that is seen."""

WITHIN_MS = {"numpy": 1.0, "mujoco-python": 4.0, "pybullet": 10.0, "drake": 6.0}
"""Of the path a quarter of a second later, in the time that the block takes for it; a step is 1 ms. MuJoCo's friction
is that of the step before. What Bullet's and Drake's creep has added to the first 0.1 mm (10 µm) is 3 ms of a slide
that begins from rest as t³; where friction falls with speed, such a start is felt longer."""

DIRECTIONS = (math.radians(25), math.radians(250))


def found(name: str, model: Model) -> list[Deviation]:
    """The deviations in an engine, or a skipped test; they are printed, for pytest -s."""
    if importlib.util.find_spec(MODULES[name]) is None:
        pytest.skip(f"{name} is not installed (pip install --group engines)")
    told = deviations(file_of("tried", model, name), model, DIRECTIONS)
    for one in told:
        print(f"{name}, down {one.down_deg:.0f}: onset {one.onset_deg:+.4f} deg, path {one.path_mm:.3f} mm", end=" ")
        print(f"of {one.gone_mm:.2f} ({one.path_ms:.2f} ms), turn {one.turn_deg:+.2f} deg of {one.turned_deg:+.2f}")
    return told


def test_every_format_of_models_is_tried_here():
    assert set(MODULES) == set(model_formats())


@pytest.mark.parametrize("case", TEXTS)
@pytest.mark.parametrize("name", MODULES)
def test_the_block_slides_as_in_our_own_simulation(name: str, case: str):
    for one in found(name, model_of(TEXTS[case])):
        assert abs(one.onset_deg) < WITHIN_DEG[name]
        assert one.path_ms < WITHIN_MS[name]


def test_without_the_effects_the_engine_is_off_by_many_times_the_tolerance():
    """The comparison can fail: a file with friction alone is not the model with its effects."""
    model = model_of(TEXTS["static_and_kinetic"])
    plain = file_of("tried", model_of(TEXTS["plain"]), "numpy")
    (one,) = deviations(plain, model, DIRECTIONS[:1])
    assert abs(one.onset_deg) > 50 * WITHIN_DEG["numpy"]


def test_a_block_turns_as_in_our_own_simulation_on_an_even_sole():
    for one in found("numpy", model_of(TURNS)):
        assert abs(one.onset_deg) < 0.06  # a moment at rest and its friction share a limit surface, step by step
        assert one.turn_deg == pytest.approx(0, abs=0.1 * abs(one.turned_deg))


def test_an_engine_says_that_a_block_on_four_corners_turns_less():
    for name in ("mujoco-python", "pybullet", "drake"):
        file = file_of("tried", model_of(TURNS), name)
        assert "four corners" in file.unsaid[0]
        assert "four corners" in " ".join(file.text.replace("#", "").split())
    assert not file_of("tried", model_of(TURNS), "numpy").unsaid


def test_only_numpy_lets_a_block_at_rest_creep():
    model = model_of(CREEPS)
    assert not file_of("tried", model, "numpy").unsaid
    for name in ("mujoco-python", "pybullet", "drake"):
        (sentence,) = file_of("tried", model, name).unsaid
        assert "leaves out of solver_creep: its motion of a block at rest" in sentence
    one = found("numpy", model)[0]
    assert abs(one.onset_deg) < 0.02
    assert one.gone_mm > 0.1


@pytest.mark.parametrize("case", ["plain", "grain"])
def test_friction_by_direction_alone_is_a_scene_without_code(case: str, tmp_path: Path):
    """The planar onset of the model is the engine's, at the tolerance of the exported pairs."""
    model = model_of(TEXTS[case])
    for file in export_model(NamedModel("tried", model), "mujoco"):
        (tmp_path / file.name).write_text(file.text, encoding="utf-8")
    for down in np.radians([10.0, 100.0, 215.0]):
        expected = float(math.atan(_held(model, float(down))))
        bench = engines()["MuJoCo"].load(tmp_path, "block_on_plate")
        seen = onset(bench, float(down), expected_rad=expected)
        assert math.degrees(seen.angle_rad - expected) == pytest.approx(0, abs=0.05)


def _held(model: Model, down_rad: float) -> float:
    """The smallest h / cos: what an ellipse holds against a pull, found on a fine grid."""
    off = np.linspace(-1.4, 1.4, 20001)
    return float((model.friction(contact(way_rad=down_rad + off)) / np.cos(off)).min())
