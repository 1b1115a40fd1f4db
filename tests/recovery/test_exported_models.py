"""Exported models in their engines: the block slides as in our own simulation, in a Python that has no Repose.

An engine that is not installed is skipped (NumPy and MuJoCo always are).
"""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from station.export import export_model, model_formats
from station.export.carried.states import contact
from station.export.carried.tilt_test import SEEN_M
from station.export.deviation import Compared, Deviation, all_deviations, deviations
from station.export.from_model import NamedModel
from station.physics.model import Model
from station.simulators.planar.commands import ramps
from station.simulators.planar.simulate import simulate
from tests.recovery.engines import engines
from tests.recovery.engines.tilt import onset
from tests.unit.export.apart import apart
from tests.unit.export.models import CREEPS, TEXTS, TURNS, file_of, model_of

MODULES = {"numpy": "numpy", "mujoco-python": "mujoco", "pybullet": "pybullet", "drake": "pydrake"}
WITHIN_DEG = {"numpy": 0.005, "mujoco-python": 0.01, "pybullet": 0.03, "drake": 0.02}
"""The tolerance of the tilt at 2°/s when the block has gone 0.1 mm. A step of 1 ms is 0.002°. MuJoCo reads each
friction one step late. Bullet's solver stops after 50 rounds. Drake's friction is full at 10 µm/s alone: until it
slides, the block creeps by 10 µm a second, a tenth of the way that is seen."""

WITHIN_MS = {"numpy": 1.0, "mujoco-python": 4.0, "pybullet": 10.0, "drake": 6.0}
"""The tolerance of the path a quarter of a second later, in the time that the block takes for it; a step is 1 ms.
MuJoCo's friction is that of the step before. What Bullet's and Drake's creep has added to the first 0.1 mm (10 µm) is 3
ms of a slide that begins from rest as t³; where friction falls with speed, such a start is felt longer."""

DIRECTIONS = (math.radians(25), math.radians(250))
ALIKE = {"plain", "static_and_kinetic", "speed_law"}
"""Models that act alike in every direction, for which one will do: an engine takes seconds for each."""
FOUR_CORNERS = (math.radians(280),)
"""A direction in which a block with its mass off the middle turns while it slides."""


def asked(name: str) -> dict[str, tuple[Model, Sequence[float]]]:
    """All that an engine is to run, by the file's stem: its Python starts once."""
    alike = {case: (model_of(text), DIRECTIONS[: 1 if case in ALIKE else 2]) for case, text in TEXTS.items()}
    turning: dict[str, dict[str, tuple[Model, Sequence[float]]]] = {
        "mujoco-python": {"turns": (model_of(TURNS), FOUR_CORNERS)},
        "numpy": {"turns": (model_of(TURNS), DIRECTIONS), "creeps": (model_of(CREEPS), DIRECTIONS)},
    }
    return {**alike, **turning.get(name, {})}


@cache
def all_found(name: str) -> dict[str, list[Deviation]]:
    """The deviations in an engine, by what was asked."""
    tried = asked(name)
    compared = [Compared(file_of(stem, model, name), model, ways) for stem, (model, ways) in tried.items()]
    return dict(zip(tried, all_deviations(compared), strict=True))


def found(name: str, case: str) -> list[Deviation]:
    """The deviations in an engine, or a skipped test; they are printed, for pytest -s."""
    if importlib.util.find_spec(MODULES[name]) is None:
        pytest.skip(f"{name} is not installed (pip install --group engines)")
    told = all_found(name)[case]
    for one in told:
        print(f"{name}, down {one.down_deg:.0f}: onset {one.onset_deg:+.4f} deg, path {one.path_mm:.3f} mm", end=" ")
        print(f"of {one.gone_mm:.2f} ({one.path_ms:.2f} ms), turn {one.turn_deg:+.2f} deg of {one.turned_deg:+.2f}")
    return told


def test_every_format_of_models_is_tried_here():
    assert set(MODULES) == set(model_formats())


@pytest.mark.parametrize("case", TEXTS)
@pytest.mark.parametrize("name", MODULES)
def test_the_block_slides_as_in_our_own_simulation(name: str, case: str):
    for one in found(name, case):
        assert abs(one.onset_deg) < WITHIN_DEG[name]
        assert one.path_ms < WITHIN_MS[name]


def test_without_the_effects_the_engine_is_off_by_many_times_the_tolerance():
    """The comparison can fail: a file with friction alone is not the model with its effects."""
    model = model_of(TEXTS["static_and_kinetic"])
    plain = file_of("tried", model_of(TEXTS["plain"]), "numpy")
    (one,) = deviations(plain, model, DIRECTIONS[:1])
    assert abs(one.onset_deg) > 50 * WITHIN_DEG["numpy"]


def test_a_block_turns_as_in_our_own_simulation_on_an_even_sole():
    for one in found("numpy", "turns"):
        assert abs(one.onset_deg) < 0.06  # a moment at rest and its friction share a limit surface, step by step
        assert one.turn_deg == pytest.approx(0, abs=0.1 * abs(one.turned_deg))


def test_a_block_on_four_corners_starts_as_one_on_an_even_sole_in_mujoco():
    (one,) = found("mujoco-python", "turns")
    assert abs(one.onset_deg) < 0.2  # 0.79 with the even sole's moment
    assert one.turn_deg == pytest.approx(0, abs=0.6 * abs(one.turned_deg))


def test_an_engine_says_that_a_block_on_four_corners_turns_less():
    for name in ("mujoco-python", "pybullet", "drake"):
        file = file_of("tried", model_of(TURNS), name)
        assert "four corners" in file.unsupported[0]
        assert "four corners" in " ".join(file.text.replace("#", "").split())
    assert not file_of("tried", model_of(TURNS), "numpy").unsupported


def test_only_numpy_lets_a_block_at_rest_creep():
    model = model_of(CREEPS)
    assert not file_of("tried", model, "numpy").unsupported
    for name in ("mujoco-python", "pybullet", "drake"):
        (sentence,) = file_of("tried", model, name).unsupported
        assert "leaves out of solver_creep: its motion of a block at rest" in sentence
    one = found("numpy", "creeps")[0]
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


TILTING_PLATE = """
import mujoco, numpy as np
import tried_mujoco as file

scene = file.SCENE.replace('<body name="plate">', '<body name="plate"><joint name="tilt" axis="0 1 0"/>')
mujoco.set_mjcb_passive(None)
m = mujoco.MjModel.from_xml_string(scene)
d = mujoco.MjData(m)
m.body_gravcomp[m.body("plate").id] = 1.0
friction = file.Friction(m, file.Law(file.MODEL, file.Watch()), plate="plate", block="object")
friction.install()
ramp = file.Ramp(0.0, START, 0.035, 3.0)
tilt, object = m.joint("tilt").qposadr[0], m.body("object").id
mujoco.mj_resetData(m, d)
d.qpos[tilt] = START
turn = np.array([np.cos(START / 2), 0.0, np.sin(START / 2), 0.0])
free = m.body("object").jntadr[0]
d.qpos[m.jnt_qposadr[free] + 3 : m.jnt_qposadr[free] + 7] = turn
seen = None
while d.time < 3.0 and seen is None:
    d.qpos[tilt] = ramp.tilt_rad(d.time)
    d.qvel[m.joint("tilt").dofadr[0]] = ramp.rate_rad_s if d.time > ramp.held_s else 0.0
    mujoco.mj_step(m, d)
    plate = d.xmat[m.body("plate").id].reshape(3, 3)
    x = float((plate.T @ d.xpos[object])[0])
    if d.time < ramp.held_s:
        start = x
    elif x - start > file.SEEN_M:
        seen = ramp.tilt_rad(d.time)
print(seen)
"""


def test_a_plate_that_tilts_in_the_world_is_as_good_as_gravity_that_turns(tmp_path: Path):
    """Ageing and a grain: the callback finds the plate's frame, the block's place in it, and the time at rest."""
    model = model_of(TEXTS["static_and_kinetic"] + "\n" + TEXTS["grain"])
    file = file_of("tried", model, "mujoco-python")
    start = simulate(ramps([0, 40], [0, 1.4]), model).onset_rad[0] - 0.04
    seen = float(apart(tmp_path, [file], TILTING_PLATE.replace("START", repr(float(start)))))
    knots = [0.0, 0.3, 3.0]
    stamps = np.arange(0.3, 3.0, 1e-3)
    moved = simulate(ramps(knots, [start, start, start + 0.035 * 2.7]), model, time_s=stamps)
    ours = float(np.interp(SEEN_M, moved.path[0, :, 0], start + 0.035 * (stamps - 0.3)))
    assert math.degrees(seen - ours) == pytest.approx(0, abs=0.03)
