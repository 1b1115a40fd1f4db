"""The comparison on the simulated rig finds the paper's planted biases again.

The whole command in simulated time: twin, arm agent, sources, procedure, recording, and the numbers from the recording.
"""

from __future__ import annotations

import csv
import io
import math
from contextlib import redirect_stdout
from dataclasses import dataclass
from pathlib import Path

import pytest

from station.__main__ import main
from station.recording.reader import open_recording

BARE = """
id = "compared"
[arm]
driver = "simulated"
[twin]
pair = "steel_on_steel"
"""
PAPER = f"""{BARE}

[angles.internal]  # the arm's own: Table I has 0.16 against the reference
kind = "kinematics"
mount_rpy_deg = [-0.16, 0.0, 0.0]

[angles.imu]  # the noisiest: 0.4
kind = "simulated"
noise_deg = 0.4

[angles.mocap]  # "an offset of around 0.5 degrees"
kind = "simulated"
offset_deg = 0.5
noise_deg = 0.05

[angles.inclinometer]
kind = "simulated"
axes = 1
gain = 1.01
hysteresis_deg = 0.1
noise_deg = 0.03
resolution_deg = 0.01
"""


@dataclass(frozen=True)
class Result:
    """The files and numbers that the command left behind."""

    recording: Path
    text: str
    pairs: dict[frozenset[str], dict[str, float]]
    fits: dict[str, dict[str, float]]


def run(folder: Path, rig: str, *options: str) -> Result:
    (folder / "rig.toml").write_text(rig, encoding="utf-8")
    recording = folder / "angles.mcap"
    words = ["compare-angles", "--rig", str(folder / "rig.toml"), "--out", str(recording), "--lockstep"]
    return result_of([*words, *options], folder, recording)


def result_of(words: list[str], folder: Path, recording: Path) -> Result:
    text = io.StringIO()
    with redirect_stdout(text):
        status = main([*words, "--table", str(folder / "pairs.csv"), "--fits", str(folder / "fits.csv")])
    assert status == 0
    pairs = list(csv.DictReader((folder / "pairs.csv").read_text(encoding="utf-8").splitlines()))
    fits = list(csv.DictReader((folder / "fits.csv").read_text(encoding="utf-8").splitlines()))
    return Result(
        recording,
        text.getvalue(),
        {frozenset((row.pop("first"), row.pop("second"))): _floats(row) for row in pairs},
        {row.pop("source"): _floats(row, "reference") for row in fits},
    )


def _floats(row: dict[str, str], *but: str) -> dict[str, float]:
    return {key: float(value) for key, value in row.items() if key not in but and value}


@pytest.fixture(scope="module")
def paper(tmp_path_factory: pytest.TempPathFactory) -> Result:
    return run(tmp_path_factory.mktemp("paper"), PAPER, "--step-deg", "5")


def pair(result: Result, first: str, second: str) -> dict[str, float]:
    return result.pairs[frozenset((first, second))]


def test_the_internal_sensors_bias(paper: Result) -> None:
    cell = pair(paper, "commanded", "internal")
    assert cell["mean_abs_deg"] == pytest.approx(0.16, abs=0.005)
    assert paper.fits["internal"]["offset_deg"] == pytest.approx(0.16, abs=0.005)


def test_the_imus_noise(paper: Result) -> None:
    cell = pair(paper, "commanded", "imu")
    assert cell["sd_deg"] == pytest.approx(0.40, abs=0.02)
    assert cell["mean_abs_deg"] == pytest.approx(0.40 * math.sqrt(2 / math.pi), abs=0.02)
    assert paper.fits["imu"]["noise_deg"] == pytest.approx(0.40, abs=0.02)
    assert paper.fits["imu"]["offset_low_deg"] < 0.03
    assert paper.fits["imu"]["offset_high_deg"] > -0.03


def test_the_motion_captures_offset(paper: Result) -> None:
    assert pair(paper, "commanded", "mocap")["mean_abs_deg"] == pytest.approx(0.50, abs=0.01)
    assert pair(paper, "internal", "mocap")["mean_abs_deg"] == pytest.approx(0.34, abs=0.01)
    fit = paper.fits["mocap"]
    assert fit["offset_deg"] == pytest.approx(0.5, abs=0.01)
    assert fit["offset_high_deg"] - fit["offset_low_deg"] < 0.02


def test_the_inclinometers_gain_and_hysteresis(paper: Result) -> None:
    fit = paper.fits["inclinometer"]
    assert fit["gain"] == pytest.approx(1.01, abs=0.001)
    assert fit["hysteresis_deg"] == pytest.approx(0.1, abs=0.01)
    assert abs(paper.fits["mocap"]["hysteresis_deg"]) < 0.01


def test_every_stop_was_read_fifty_times(paper: Result) -> None:
    assert "(21 stops)" in paper.text
    for name in ("internal", "imu", "mocap", "inclinometer"):
        assert paper.fits[name]["readings"] >= 21 * 50


def test_the_recording_gives_the_same_again(paper: Result) -> None:
    again = result_of(["compare-angles", "--from", str(paper.recording)], paper.recording.parent, paper.recording)
    assert again.pairs == paper.pairs
    assert again.fits == paper.fits
    assert again.text in paper.text


def test_the_truth_is_in_the_recording_but_not_in_the_answer(paper: Result) -> None:
    assert "truth/scene" not in {item.topic for item in open_recording(paper.recording).messages()}


def test_the_same_rig_gives_the_same_numbers(paper: Result, tmp_path: Path) -> None:
    again = run(tmp_path, PAPER, "--step-deg", "10", "--sweeps", "1", "--readings", "10")
    other = run(tmp_path, PAPER, "--step-deg", "10", "--sweeps", "1", "--readings", "10", "--overwrite")
    assert again.pairs == other.pairs


def test_another_direction_and_no_bias_give_none(tmp_path: Path) -> None:
    rig = f"{BARE}[angles.kinematics]\n[angles.simulated]\nazimuth_deg = 90\n"
    found = run(tmp_path, rig, "--direction", "1", "--step-deg", "5", "--sweeps", "1", "--readings", "5")
    for name in ("kinematics", "simulated"):
        assert pair(found, "commanded", name)["mean_abs_deg"] < 0.005


def test_a_gauge_whose_values_were_written_down(tmp_path: Path) -> None:
    (tmp_path / "gauge.txt").write_text("0.2\n5.2\n10.2\n5.2\n0.2\n", encoding="utf-8")
    rig = f'{BARE}[angles.kinematics]\n[angles.typed]\nfile = "gauge.txt"\n'
    found = run(tmp_path, rig, "--step-deg", "5", "--sweeps", "1", "--readings", "5")
    assert pair(found, "commanded", "typed")["mean_abs_deg"] == pytest.approx(0.2, abs=0.001)
    assert pair(found, "kinematics", "typed")["sd_deg"] < 0.005


@pytest.mark.parametrize(
    ("rig", "options", "said"),
    [
        ('id = "x"\n', [], "at least one table"),
        ('id = "x"\n[angles.mavlink]\n', [], "mavlink is a real sensor"),
        ('id = "x"\n[angles.kinematics]\n', ["--step-deg", "20"], "expected steps smaller"),
        ('id = "x"\n[angles.simulated]\nnoise = 0.4\n', [], "line 3"),
    ],
)
def test_mistakes_end_in_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], rig: str, options: list[str], said: str
) -> None:
    (tmp_path / "rig.toml").write_text(rig, encoding="utf-8")
    words = ["compare-angles", "--rig", str(tmp_path / "rig.toml"), "--out", str(tmp_path / "a.mcap"), "--lockstep"]
    assert main([*words, *options]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert "Traceback" not in error


def test_a_tilt_beyond_the_arms_reach_ends_early_and_keeps_what_was_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "rig.toml").write_text(PAPER, encoding="utf-8")
    words = ["compare-angles", "--rig", str(tmp_path / "rig.toml"), "--out", str(tmp_path / "a.mcap"), "--lockstep"]
    assert main([*words, "--to-deg", "80", "--step-deg", "40", "--rate-deg-s", "30", "--readings", "5"]) == 1
    shown = capsys.readouterr()
    assert "The arm refused to move" in shown.err
    assert "(2 stops)" in shown.out


def test_an_arm_that_may_not_move_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "rig.toml").write_text(PAPER.replace("[arm]", "[arm]\narmed = false"), encoding="utf-8")
    words = ["compare-angles", "--rig", str(tmp_path / "rig.toml"), "--out", str(tmp_path / "a.mcap"), "--lockstep"]
    assert main(words) == 2
    error = capsys.readouterr().err
    assert "The arm refused to move: The arm is read-only" in error
    assert "nothing can be compared" in error
