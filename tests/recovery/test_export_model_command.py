"""`station export model.toml`: what it writes, prints and answers."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from station.__main__ import main
from station.export import export_formats, model_formats
from tests.readmes.blocks import blocks
from tests.system.processes import rig_file
from tests.unit.export.models import CREEPS, TEXTS
from tests.unit.export.pairs import exported

HEAD = "[friction]\nmu_s = 0.36\nscatter = 0.1\n"
PYTHON = sorted(model_formats())


def model(folder: Path, text: str, name: str = "my model.toml") -> str:
    (folder / name).write_text(HEAD + text, encoding="utf-8")
    return str(folder / name)


def test_a_model_becomes_a_file_of_python_for_each_engine(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    path, out = model(tmp_path, TEXTS["speed_law"] + "\n" + CREEPS), tmp_path / "out"
    assert main(["export", path, "--format", ",".join(PYTHON), "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert {one.name for one in out.iterdir()} == {
        f"my_model_{end}.py" for end in ("numpy", "mujoco", "pybullet", "drake")
    }
    assert all(str(one) in printed for one in out.iterdir())
    for engine in ("MuJoCo", "PyBullet", "Drake"):
        sentence = f"{engine} leaves out of solver_creep"
        assert sentence in printed
        assert sentence in (out / f"my_model_{engine.lower()}.py").read_text("utf-8")


def test_without_a_format_it_is_numpy(tmp_path: Path):
    assert main(["export", model(tmp_path, ""), "--out", str(tmp_path)]) == 0
    assert [one.name for one in tmp_path.glob("*.py")] == ["my_model_numpy.py"]


def test_friction_by_direction_goes_into_every_format(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    out = tmp_path / "out"
    assert main(["export", model(tmp_path, TEXTS["grain"]), "--format", "all", "--out", str(out)]) == 0
    written = {one.name for one in out.iterdir()}
    assert {
        "block_on_plate.mjcf.xml",
        "block_on_plate.gazebo.sdf",
        "friction_pairs.json",
        "my_model_drake.py",
    } <= written
    scene = (out / "block_on_plate.mjcf.xml").read_text("utf-8")
    size, axis = math.hypot(0.3, 0.2), 0.5 * math.degrees(math.atan2(0.2, 0.3))
    assert f"mu_1 {0.36 * math.exp(size / 2):.4f} along {axis:.1f} degrees from x of the plate" in scene
    assert "<plugin" not in scene
    assert "Scatter from run to run is left out" in capsys.readouterr().out


def test_a_grain_of_the_object_stays_with_it(tmp_path: Path):
    text = TEXTS["grain"].replace("plate_", "object_")
    assert main(["export", model(tmp_path, text), "--format", "mujoco", "--out", str(tmp_path)]) == 0
    assert '<body name="object" quat' in (tmp_path / "block_on_plate.mjcf.xml").read_text("utf-8")


def test_all_writes_what_can_be_and_names_the_rest(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    out = tmp_path / "out"
    assert main(["export", model(tmp_path, TEXTS["speed_law"]), "--format", "all", "--out", str(out)]) == 1
    assert len(list(out.iterdir())) == len(PYTHON)
    printed = capsys.readouterr().out
    for name in set(export_formats()) - set(PYTHON):
        assert (
            f"Not written: Expected a model of friction by direction alone for --format {name}, got stribeck" in printed
        )


def test_the_distance_from_our_own_simulation_is_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    words = ["export", model(tmp_path, ""), "--format", "numpy", "--compare", "--out", str(tmp_path)]
    assert main(words) == 0
    printed = capsys.readouterr().out
    assert "Deviation from our own simulation" in printed
    assert float(printed.partition("worst onset ")[2].split()[0]) < 0.005


def test_a_file_that_cannot_run_is_named_in_its_place(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    steep = tmp_path / "steep.toml"
    steep.write_text("[friction]\nmu_s = 19.0\n", encoding="utf-8")
    assert main(["export", str(steep), "--compare", "--out", str(tmp_path)]) == 0
    assert "Expected a block that slides by 80 degrees" in capsys.readouterr().out


def test_an_effect_of_ones_own_needs_a_rig_file_that_names_its_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    (humidity,) = [block.text for block in blocks("python") if block.readme == "station/physics/README.md"]
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "humidity.py").write_text(humidity, encoding="utf-8")
    rig = rig_file(tmp_path, name="own", extra='[physics]\neffects = ["mine"]\n')
    path = model(tmp_path, "[effects.humidity]\nslope = 0.3\n")
    assert main(["export", path, "--rig", str(rig), "--out", str(tmp_path)]) == 0
    assert "contact.relative_humidity" in (tmp_path / "my_model_numpy.py").read_text("utf-8")
    assert main(["export", path, "--out", str(tmp_path / "other")]) == 2
    assert "got humidity" in capsys.readouterr().err


def test_mistakes_are_one_sentence_and_end_with_two(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    fine = model(tmp_path, "", "fine.toml")
    moving = model(tmp_path, TEXTS["static_and_kinetic"], "moving.toml")
    grain = "[effects.plate_anisotropy]\ncos2 = 0.3\n"
    both = model(tmp_path, grain + grain.replace("plate", "object"), "both.toml")
    pinched = model(tmp_path, grain + "shape = 0.5", "pinched.toml")
    unknown = model(tmp_path, "[effects.static_cling]\nforce_n = 1.0", "unknown.toml")
    pairs = str(exported(tmp_path, "json") / "friction_pairs.json")
    for words, expected in (
        ([unknown], "got static_cling"),
        (
            [moving, "--format", "usd"],
            "for --format usd, got contact_aging, kinetic_drop in it; export",
        ),
        ([both, "--format", "mujoco"], "Expected a grain of the plate or of the object for --format mujoco, got both"),
        ([pinched, "--format", "mujoco"], "Expected a circle or an ellipse of friction for --format mujoco"),
        ([fine, "--format", "unity"], "got 'unity'"),
        ([fine, pairs], "Expected one model.toml and nothing beside it"),
        ([fine, "--out", f"{fine}/x"], "Expected to write to the folder"),
        ([str(tmp_path / "none.toml")], "none.toml, but it cannot be read"),
        ([model(tmp_path, "[effects.wear", "broken.toml")], "expected TOML"),
        ([model(tmp_path, "[effects.wear]\nfall = 5", "far.toml")], "effects.wear.fall, got 5"),
    ):
        assert main(["export", *words]) == 2, words
        said = capsys.readouterr().err
        assert expected in said
        assert said.count("\n") == 1
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Path, "exists", _refused)
    assert main(["export", fine]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def _refused(_path: Path) -> bool:
    raise PermissionError(13, "Permission denied")
