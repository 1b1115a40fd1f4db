from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from pi_agent.__main__ import COMMANDS, main
from tests.patience import PATIENCE_S


def test_a_missing_rig_file_is_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    assert main(["--rig", str(tmp_path / "rig.toml")]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "rig.toml" in said


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('id = "a"\n[camera]\nrate = 90\n', "line 3"),
        ('id = "a"\n[camera]\ndriver = "polaroid"\n', "polaroid"),
        ('id = "a"\n[camera]\ndriver = "synthetic"\n[camera.options]\nlight = "much"\n', "line 5"),
        ('id = "a"\n[camera]\ncalibration = "none.toml"\n', "none.toml"),
    ],
)
def test_a_wrong_rig_file_is_named_with_its_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, said: str
):
    file = tmp_path / "rig.toml"
    file.write_text(
        text.replace("[camera]", '[bus]\ncamera = ""\narm = ""\nstation = ""\n[camera]').replace("line", "")
    )
    assert main(["run", "--rig", str(file)]) == 2
    err = capsys.readouterr().err
    assert "Traceback" not in err
    expected = {"line 3": "rate", "line 5": "light"}.get(said, said)
    assert expected in err


def test_options_of_another_driver_are_said_to_be_left_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    file = tmp_path / "rig.toml"
    text = 'id = "a"\n[bus]\ncamera = ""\narm = ""\nstation = ""\n[camera]\ndriver = "synthetic"\n'
    file.write_text(text + '[camera.options]\npath = "frames"\n')
    assert main(["run", "--rig", str(file), "--camera", "video_file"]) == 2
    said = capsys.readouterr().err
    assert "'path'" in said
    assert "rig.toml, whose [camera.options] are for synthetic, not for video_file" in said


def test_help_names_the_commands_and_the_drivers(capsys: pytest.CaptureFixture[str]):
    with pytest.raises(SystemExit) as end:
        main(["--help"])
    assert end.value.code == 0
    assert "pi-agent calibrate" in capsys.readouterr().out
    with pytest.raises(SystemExit):
        main(["run", "--help"])
    assert "video_file" in capsys.readouterr().out


def test_alone_it_shows_help(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    assert main([]) == 0
    said = capsys.readouterr().out
    assert said.startswith("usage: pi-agent ")
    assert all(f"    {name} " in said for name in COMMANDS)
    assert "Exit status: 0: done;" in said
    assert said.rstrip().splitlines()[-1] == "  pi-agent run --rig rig.toml"
    assert max(map(len, said.splitlines())) <= 80, "what is not broken anew fits a terminal of 80 letters"


@pytest.mark.parametrize("name", COMMANDS)
def test_a_commands_help_ends_with_an_example_of_it(name: str, capsys: pytest.CaptureFixture[str]):
    with pytest.raises(SystemExit, match="0"):
        main([name, "--help"])
    said = capsys.readouterr().out
    assert said.rstrip().splitlines()[-1].startswith(f"  pi-agent {name} ")
    assert "Exit status: 0: done;" in said
    assert "(default: None)" not in said
    assert said.count("(default: rig.toml") == (name != "track")


@pytest.mark.parametrize(
    ("words", "meant"),
    [(["rnu"], "did you mean run?"), (["serve", "--bord", "9x7x6"], "did you mean --board?"), (["--rgi"], "--rig?")],
)
def test_a_slip_of_the_pen_is_named(words: list[str], meant: str, capsys: pytest.CaptureFixture[str]):
    with pytest.raises(SystemExit, match="2"):
        main(words)
    assert meant in capsys.readouterr().err


def test_a_reader_that_has_seen_enough_gets_no_traceback(tmp_path: Path):
    picture = str(tmp_path / "grey.png")
    cv2.imwrite(picture, np.full((64, 64), 90, dtype=np.uint8))
    command = [sys.executable, "-m", "pi_agent", "track", *(500 * [picture])]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as track:
        assert track.stdout is not None
        assert track.stderr is not None
        track.stdout.readline()
        track.stdout.close()
        assert track.stderr.read() == b""
        assert track.wait(timeout=PATIENCE_S) == 0
