"""Nothing that measures may know the simulation's truth: without it every answer is the same, bit for bit."""

import subprocess
import sys
from pathlib import Path

import pytest

from station.__main__ import main
from station.recording.reader import open_recording
from station.recording.repair import copy_without


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A simulated session, and the same without the truth, under the same name."""
    folder = tmp_path_factory.mktemp("truth")
    whole, stripped = folder / "with" / "session.mcap", folder / "without" / "session.mcap"
    whole.parent.mkdir()
    stripped.parent.mkdir()
    assert main(["run", "--lockstep", "--samples", "2", "--seed", "5", "--out", str(whole)]) == 0
    copy_without(whole, stripped, drop=lambda topic: topic.startswith("truth/"))
    assert any(name.startswith("truth/") for name in open_recording(whole).topics)
    assert not any(name.startswith("truth/") for name in open_recording(stripped).topics)
    return whole, stripped


@pytest.mark.parametrize("words", [["samples"], ["check"], ["doctor"]])
def test_a_commands_answer_does_not_change_without_the_truth(recordings: tuple[Path, Path], words: list[str]):
    answers = [
        subprocess.run(
            [sys.executable, "-m", "station", *words, "session.mcap"],
            cwd=path.parent,
            env={"PYTHONPATH": str(Path(__file__).parents[3])},
            capture_output=True,
            check=False,
        )
        for path in recordings
    ]
    assert answers[0].stdout == answers[1].stdout
    assert answers[0].returncode == answers[1].returncode
    assert answers[0].stdout


def test_the_tables_are_the_same_bytes(recordings: tuple[Path, Path], tmp_path: Path):
    for number, path in enumerate(recordings):
        assert main(["samples", str(path), "--csv", str(tmp_path / f"{number}.csv")]) == 0
    assert (tmp_path / "0.csv").read_bytes() == (tmp_path / "1.csv").read_bytes()
