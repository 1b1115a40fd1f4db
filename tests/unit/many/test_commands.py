"""The commands over many recordings: rows, JSON, exit statuses, and one file exactly as before."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from shared.errors import UserError
from station.__main__ import main
from station.app import analysis_files
from station.app.many import diagnoses
from station.recording.tables import read_samples
from tests.patience import PATIENCE_S
from tests.recovery.test_analysis_command import recorded
from tests.unit.diagnosis.recorded import GOLDEN
from tests.unit.friction.sessions import session

COMMANDS = ("doctor", "samples", "analyze", "diagnose")


@pytest.fixture(autouse=True)
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with two good recordings and a damaged one in `recs`."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(analysis_files, "figure_kinds", tuple)
    Path("recs").mkdir()
    shutil.copy(GOLDEN, "recs/a.mcap")
    recorded(session(5, rng=np.random.default_rng(1)), Path("recs/b.mcap"))
    Path("recs/torn.mcap").write_bytes(GOLDEN.read_bytes()[:30_000])
    return tmp_path


def given(path: Path, *, name: str, **_asked: Any) -> Any:
    """A diagnosis that takes no time; what reading says of a file, it says as well."""
    read_samples(path)
    return type("Examined", (), {"diagnosis": name})


def as_json(name: str) -> dict[str, Any]:
    found = {"effects": [{"id": "wear", "verdict": "supported"}], "fit": {"gap_closed": None}, "global_p": 0.5}
    return {"recording": name, "runs": {"used": 3}, "verdict": "supported", "seconds": 1.0} | found


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(diagnoses, "diagnose_file", given)
    monkeypatch.setattr(diagnoses, "as_json", as_json)


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("command", COMMANDS)
def test_a_damaged_recording_stops_no_other(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([command, "recs", "--jobs", "1"]) == 1
    said = capsys.readouterr().out
    assert "✗ recs/torn.mcap: Expected a finished recording" in said
    assert "3 recordings: 2 done, 1 could not be read." in said
    assert all(f"recs/{name}.mcap" in said for name in "ab")


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("command", COMMANDS)
def test_if_none_can_be_read_it_is_a_mistake(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("recs/more.mcap").write_bytes(b"no recording")
    assert main([command, "recs/torn.mcap", "recs/more.mcap", "--jobs", "1"]) == 2
    assert "2 recordings: 2 could not be read." in capsys.readouterr().out


@pytest.mark.parametrize("command", COMMANDS)
def test_a_missing_file_is_said_before_any_work(command: str, lab: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([command, "recs/a.mcap", "recs/none.mcap"]) == 2
    captured = capsys.readouterr()
    assert captured.err.strip().endswith("recs/none.mcap, but it cannot be read: No such file or directory")
    assert (captured.out, [path.name for path in lab.iterdir()]) == ("", ["recs"])


@pytest.mark.usefixtures("quick")
def test_answers_are_kept_and_taken_again(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["diagnose", "recs/a.mcap", "recs/b.mcap", "--jobs", "1", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    kept = sorted(json.loads(path.read_text("utf-8"))["recording"] for path in Path("diagnoses/_results").iterdir())
    assert [one["recording"] for one in printed] == kept == ["recs/a.mcap", "recs/b.mcap"]
    assert main(["diagnose", "recs/*.mcap", "--jobs", "1"]) == 1
    assert "3 recordings: 2 there already, 1 could not be read. Results: diagnoses" in capsys.readouterr().out
    assert main(["diagnose", "recs/a.mcap", "recs/b.mcap", "--jobs", "1", "--seed", "2"]) == 0
    assert "2 recordings: 2 done." in capsys.readouterr().out


def test_what_was_asked_with_a_mistake_is_said_before_any_work(capsys: pytest.CaptureFixture[str]) -> None:
    for words, said in (
        (["--rig", "none.toml"], "none.toml"),
        (["--report", "page.html"], "Expected one file together with --report and no --out, got 3"),
        (["--jobs", "-1"], "Expected --jobs of 0 or more, got -1"),
        (["--backend", "dask"], "Expected --backend dask=ADDRESS or ray, got dask"),
        (["--out", "recs/a.mcap"], "Expected to write to the folder recs/a.mcap"),
    ):
        assert main(["diagnose", "recs", *words]) == 2
        error = capsys.readouterr().err
        assert said in error
        assert len(error.splitlines()) == 1


def test_json_is_a_list_of_what_each_alone_prints(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", "recs/a.mcap", "--json"]) == 1
    alone = json.loads(capsys.readouterr().out)
    assert main(["doctor", "recs/a.mcap", "recs/torn.mcap", "--json"]) == 1
    first, torn = json.loads(capsys.readouterr().out)
    assert first == alone
    assert (torn["path"], "breaks off" in torn["error"]) == ("recs/torn.mcap", True)


@pytest.mark.parametrize("command", ["doctor", "samples"])
def test_with_a_folder_one_recording_is_a_row_as_well(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    main([command, "recs/a.mcap", "--out", "kept"])
    assert "1 recording: 1 done. Results: kept" in capsys.readouterr().out
    main([command, "recs/a.mcap", "--out", "kept"])
    assert "1 recording: 1 there already." in capsys.readouterr().out


def test_samples_that_were_kept_are_analysed_to_the_same_end() -> None:
    words = ["analyze", "recs/a.mcap", "recs/b.mcap", "--out", "report"]
    ends = list[tuple[int | str, ...]]()
    for _ in range(2):
        status = main(words)
        files = (Path("report") / name for name in ("samples.csv", "limit_curves.json"))
        ends.append((status, *(file.read_text("utf-8") for file in files)))
    assert ends[0] == ends[1]
    assert {one.object for one in read_samples(Path("report/samples.csv"))} == {"steel cube", "cube"}


SLOW = """
import sys, time
from pathlib import Path
from station.__main__ import main
from station.app.many import checkups

checked = checkups.checked

def slowly(path, name, **asked):
    if name.endswith("b.mcap"):
        Path("waiting").touch()
        time.sleep(120)
    return checked(path, name, **asked)

checkups.checked = slowly
sys.exit(main(["doctor", "recs/a.mcap", "recs/b.mcap", "--out", "kept", "--jobs", "1"]))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="process groups are not of this system")
def test_ctrl_c_loses_nothing_that_is_done(lab: Path, capsys: pytest.CaptureFixture[str]) -> None:
    env = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])}
    pipes: Any = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "encoding": "utf-8"}
    with subprocess.Popen([sys.executable, "-c", SLOW], env=env, start_new_session=True, **pipes) as command:
        last = time.monotonic() + 60.0
        while not Path("waiting").exists() and time.monotonic() < last:
            time.sleep(0.05)
        os.killpg(command.pid, signal.SIGINT)
        said, error = command.communicate(timeout=PATIENCE_S)
    assert command.returncode == 130
    assert error.splitlines() == ["Stopped after 1 of 2 recordings; the same command goes on from here.", "Stopped."]
    assert "1 recording: 1 done. Results: kept" in said
    main(["doctor", "recs/a.mcap", "recs/b.mcap", "--out", "kept"])
    assert "2 recordings: 1 done, 1 there already." in capsys.readouterr().out


def test_a_mistake_of_reading_is_no_fault_of_ours() -> None:
    with pytest.raises(UserError):
        diagnoses.diagnosed(Path("recs/torn.mcap"), "torn")
