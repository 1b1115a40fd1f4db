"""The command's mistakes are one sentence each, from the script as from `station deploy`."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from shared.errors import UserError
from shared.rig import load_rig
from station.__main__ import main
from station.app.deploy.bundle import build_release

CHECKOUT = Path(__file__).parents[3]


@pytest.mark.skipif(
    Path(sys.prefix).resolve() != (CHECKOUT / ".venv").resolve(), reason="the script uses the checkout's own .venv"
)
def test_the_script_is_the_command():
    words = [str(CHECKOUT / "deploy/deploy.sh"), "--rig", "nowhere.toml"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("station deploy: Expected USER@HOST of the Pi")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--prepare", "buster"], "Expected one of trixie, bookworm"),
        (["pi@nowhere", "--root", "here"], "Expected an absolute path on the target for --root, got 'here'"),
        (["pi@nowhere", "--rig", "/nowhere/rig.toml"], "Expected a TOML file at /nowhere/rig.toml"),
    ],
)
def test_mistakes_are_named_before_anything_is_connected(
    words: list[str], sentence: str, capsys: pytest.CaptureFixture[str]
):
    assert main(["deploy", *words]) == 2
    assert sentence in capsys.readouterr().err


def test_the_rigs_files_go_along_and_must_lie_beside_it(tmp_path: Path):
    rig = tmp_path / "rig.toml"
    rig.write_text('id = "lab"\n[camera]\ncalibration = "made/camera.toml"\n')
    with pytest.raises(UserError, match="which the rig file names, got nothing"):
        build_release(load_rig(rig), folder=tmp_path, code=CHECKOUT, keys=None, root="/")
    (tmp_path / "made").mkdir()
    (tmp_path / "made/camera.toml").write_text("x = 1\n")
    first = build_release(load_rig(rig), folder=tmp_path, code=CHECKOUT, keys=None, root="/")
    assert first.files["made/camera.toml"] == b"x = 1\n"
    assert {Path(name).parts[0] for name in first.files if name.endswith(".py")} == {"pi_agent", "shared"}
    (tmp_path / "made/camera.toml").write_text("x = 2\n")
    second = build_release(load_rig(rig), folder=tmp_path, code=CHECKOUT, keys=None, root="/")
    assert second.id != first.id, "what differs has another id"
