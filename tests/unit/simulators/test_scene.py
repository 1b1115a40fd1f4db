"""A MuJoCo scene of the user's own, driven with a recorded attitude."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from shared.errors import UserError
from station.physics.between import between
from station.physics.model import Model
from station.simulators.errors import Errors, errors
from station.simulators.simulator import Refinable, opened, simulator
from tests.unit.simulators.point_block import SCENE, SOFT_BOX
from tests.unit.simulators.test_yours import AS_IT_IS, MU, dropping, golden


def scene(folder: Path, text: str = SCENE.format(mu=MU), *, keys: str = 'block = "cube"\n') -> str:
    (folder / "scene.xml").write_text(text, encoding="utf-8")
    (folder / "scene.toml").write_text(keys, encoding="utf-8")
    return str(folder / "scene.xml")


def apart(name: str, told: Model, truth: Model) -> Errors:
    """The scene's simulation against the planar simulator's, which follows the same commands exactly."""
    signals, rig = golden()
    mine = opened(name).repeat(signals, told, rig=rig)
    return errors(simulator("planar").repeat(signals, truth, rig=rig), mine)


def test_gravity_turns_as_the_plate_was_recorded_to(tmp_path: Path) -> None:
    found = apart(scene(tmp_path), AS_IT_IS, Model(mu_s=MU))
    assert np.abs(found.onset_deg).max() < 0.1
    assert found.path_mm.max() < 2.0


def test_a_plate_that_stands_anywhere_in_the_scene_is_the_same(tmp_path: Path) -> None:
    turned = SCENE.format(mu=MU).replace('size="1 1 0.01"', 'size="1 1 0.01" pos="0.3 -0.2 0.5" euler="90 0 30"')
    turned = turned.replace('pos="0 0 0.005"', 'pos="0.3025 -0.20433 0.5" euler="90 0 30"')
    found = apart(scene(tmp_path, turned), AS_IT_IS, Model(mu_s=MU))
    assert np.abs(found.onset_deg).max() < 0.1
    assert found.path_mm.max() < 2.0


def test_what_was_found_acts_on_the_blocks_friction(tmp_path: Path) -> None:
    before = apart(scene(tmp_path), AS_IT_IS, dropping(0.35, 0.2))
    after = apart(scene(tmp_path), between(dropping(0.35, 0.2), Model(mu_s=MU)), dropping(0.35, 0.2))
    assert np.abs(before.onset_deg).min() > 4.0
    assert np.abs(after.onset_deg).max() < 0.2
    assert after.path_mm.max() < 5.0


def test_what_its_settings_do_is_told_with_the_cure_and_the_cured_scene_is_right(tmp_path: Path) -> None:
    signals, rig = golden()
    soft = opened(scene(tmp_path, SOFT_BOX.format(mu=MU)))
    assert isinstance(soft, Refinable)
    found, cured = soft.numerics(signals, rig=rig)
    told = {(one["id"], one["unit"]): one for one in found}
    assert set(told) == {("solver_creep", "deg"), ("solver_creep", "mm"), ("cone_artifact", "deg")}
    assert told["solver_creep", "deg"]["size"] > 5.0
    assert told["solver_creep", "mm"]["cured_by"] == 'cone="elliptic", impratio="100"'
    truth = simulator("planar").repeat(signals, Model(mu_s=MU), rig=rig)
    assert np.abs(errors(truth, soft.repeat(signals, AS_IT_IS, rig=rig)).onset_deg).min() > 5.0
    assert np.abs(errors(truth, cured.repeat(signals, AS_IT_IS, rig=rig)).onset_deg).max() < 0.3


def test_of_right_settings_nothing_is_told(tmp_path: Path) -> None:
    signals, rig = golden()
    firm = opened(scene(tmp_path))
    assert isinstance(firm, Refinable)
    assert firm.numerics(signals, rig=rig) == ([], firm)


def test_a_pair_has_its_own_friction(tmp_path: Path) -> None:
    pair = f'<contact><pair geom1="plate" geom2="sole" friction="{MU} {MU} 0.005 0.0001 0.0001"/></contact>'
    text = SCENE.format(mu=0.9).replace('type="sphere"', 'name="sole" type="sphere" contype="0"')
    found = apart(scene(tmp_path, text.replace("</mujoco>", f"{pair}</mujoco>")), AS_IT_IS, Model(mu_s=MU))
    assert np.abs(found.onset_deg).max() < 0.1


MUTED = SCENE.format(mu=MU)
WRONG: dict[str, tuple[str, str, str]] = {
    "no such block": (MUTED, 'block = "puck"', r"Expected the body puck in .*scene\.xml \(key block in scene\.toml\)"),
    "no such plate": (MUTED, 'block = "cube"\nplate = "board"', "Expected the body board in .* found the bodies world"),
    "an unknown key": (MUTED, 'blok = "cube"', "scene.toml, line 1: expected one of block, plate for 'blok'"),
    "a block that is fixed": (
        MUTED.replace("<freejoint/>", ""),
        'block = "cube"',
        "Expected a free joint at the body cube of .* found none",
    ),
    "a plate that moves": (
        MUTED.replace("<worldbody>", '<worldbody><body name="board"><joint/><geom size=".1" mass="1"/></body>'),
        'block = "cube"\nplate = "board"',
        "Expected the plate board of .* fixed to the world, but it has joints",
    ),
    "no XML": ("<mujoco", 'block = "cube"', "Expected a MuJoCo scene in .*, but it cannot be read"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_scene_that_cannot_be_driven_is_one_sentence(name: str, tmp_path: Path) -> None:
    text, keys, words = WRONG[name]
    with pytest.raises(UserError, match=words) as told:
        opened(scene(tmp_path, text, keys=keys))
    assert "\n" not in str(told.value)


def test_a_scene_that_explodes_is_one_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its log into the working folder
    loud = SCENE.format(mu=MU).replace('timestep="0.002"', 'timestep="0.05"')
    loud = loud.replace('solref="0.007 1"', 'solref="-1e7 0"')
    signals, rig = golden()
    with pytest.raises(UserError, match="run 0 of the session: ") as told:
        opened(scene(tmp_path, loud)).repeat(signals, AS_IT_IS, rig=rig)
    assert "\n" not in str(told.value)


def test_a_scene_has_no_parts(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"name its bodies in scene\.toml"):
        opened(f"{scene(tmp_path)}:cube")
