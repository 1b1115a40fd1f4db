"""The example rig file holds every key that there is, each with a comment, and loads."""

from __future__ import annotations

import re
import tomllib
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, get_type_hints

import pytest

from pi_agent.cameras.pi_camera import PiCameraOptions
from shared.config import Table, parse
from shared.rig import RigConfig, load_rig
from station.angles.settings import SourceSettings
from station.angles.sources.kinematics import KinematicsOptions
from station.app import assembly
from station.app.plugins import PluginSettings
from station.arm.drivers.ros1 import Ros1Options
from station.physics.catalogue import PhysicsSettings, catalogue, catalogue_of_table
from station.rig.arm_settings import ArmSettings
from station.sampling.plan import Plan
from station.simulators.mujoco.own_settings import MujocoSettings

EXAMPLE = Path(__file__).parents[3] / "deploy/rig.example.toml"
TEXT = EXAMPLE.read_text(encoding="utf-8")
READ_BY = {
    "arm": ArmSettings,
    "camera.options": PiCameraOptions,
    "arm.options": Ros1Options,
    "angles.kinematics": (SourceSettings, KinematicsOptions),
    "physics": PhysicsSettings,
    "plugins": PluginSettings,
    "simulator.mujoco": MujocoSettings,
}
"""Tables that a part of the software reads by itself; the others are in RigConfig."""
NOT_OF_A_REAL_RIG = {"planted", "twin", "text"}
"""`[twin]` is for simulated rigs; `text` is the file itself."""


def keys_of(cls: Any, path: str = "") -> set[str]:
    """The dotted names of all keys of a configuration, down through its tables."""
    names: set[str] = set()
    hints = get_type_hints(cls)
    for spec in fields(cls):
        name = f"{path}.{spec.name}" if path else spec.name
        if is_dataclass(hints[spec.name]) and hints[spec.name] is not Table:
            names |= keys_of(hints[spec.name], name)
        elif hints[spec.name] is not Table:
            names.add(name)
    return names


def all_keys() -> set[str]:
    names = keys_of(RigConfig) - NOT_OF_A_REAL_RIG
    for path, readers in READ_BY.items():
        for reader in readers if isinstance(readers, tuple) else (readers,):
            names |= keys_of(reader, path)
    return names


def written_keys(values: dict[str, Any], path: str = "") -> set[str]:
    names: set[str] = set()
    for key, value in values.items():
        name = f"{path}.{key}" if path else key
        names |= written_keys(value, name) if isinstance(value, dict) else {name}  # pyright: ignore[reportUnknownArgumentType]
    return names


def test_every_key_stands_in_the_example_and_no_other():
    assert written_keys(tomllib.loads(TEXT)) == all_keys()


def test_the_example_is_read_by_all_its_readers():
    rig = load_rig(EXAMPLE)
    parse(PiCameraOptions, rig.camera.options)
    arm = parse(ArmSettings, rig.arm)
    parse(Ros1Options, arm.options)
    assert catalogue_of_table(rig.physics) == catalogue()
    assert rig.camera.driver == "pi_camera"
    assert arm.driver == "ros1"
    assert not arm.armed, "an example must not move an arm"


@pytest.mark.parametrize("line", [line for line in TEXT.splitlines() if re.match(r"[a-z_]+ = ", line)])
def test_each_key_has_a_comment(line: str):
    assert re.search(r"#\s+\S+", line)


def test_the_example_can_make_the_plan_of_a_session_that_names_none():
    """Its third command, `station run --rig rig.toml`, was refused: the arm reached 60.6 of 67.5 degrees."""
    assembly.require_reachable(load_rig(EXAMPLE), Plan())


def test_the_examples_mark_fits_on_its_block_with_its_rim():
    rig = load_rig(EXAMPLE)
    assert rig.mark.side_mm * (1 + 2 * rig.mark.margin) <= 1e3 * min(rig.block.size_m[:2]) + 0.01
