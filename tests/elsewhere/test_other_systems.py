"""The station and the lockstep rig without what Linux on arm64, macOS and Windows lack.

Each system is imitated in one process of its own, which runs every command and the tests of shared/system.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from station.__main__ import COMMANDS, main
from station.recording.reader import digest, open_recording
from tests.elsewhere.imitate import ABSENT_ON_WINDOWS, PLATFORMS

ROOT = Path(__file__).parents[2]
SHARED = [str(ROOT / "tests/unit/shared" / name) for name in ("test_system.py", "test_clock.py")]
LINUX_ONLY = ("station/app/deploy/target", "pi_agent/cameras")
"""The modules that run on the Raspberry Pi alone."""


def commands() -> list[str]:
    """The names of all commands, which may be two words."""
    texts = [path.read_text(encoding="utf-8") for path in sorted(COMMANDS.glob("[a-z]*.py"))]
    return [name for text in texts for name in re.findall(r'^NAME = "(.*)"$', text, re.MULTILINE)]


def command_lines(folder: Path) -> list[list[str]]:
    recording = str(folder / "session.mcap")
    return [
        ["station", "run", "--lockstep", "--samples", "2", "--seed", "3", "--out", recording],
        ["station", "samples", recording, "--csv", str(folder / "samples.csv")],
        ["station", "doctor", recording],
        ["station", "diagnose", recording, "--report", str(folder / "report.html")],
        ["station", "replay", recording, "--save", str(folder / "view.rrd"), "--no-viewer"],
        ["station", "repair", str(folder / "broken.mcap.partial")],
        ["pytest", *SHARED, "-q", "-p", "no:cacheprovider", "-p", "no:randomly"],
        *(["station", *name.split(), "--help"] for name in commands()),
    ]


@pytest.fixture(scope="module", params=PLATFORMS)
def elsewhere(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    folder = tmp_path_factory.mktemp(request.param.replace(" ", "_"))
    words = [sys.executable, "-X", "warn_default_encoding", "-m", "tests.elsewhere.imitate", request.param]
    done = subprocess.run(
        [*words, str(folder / "told.json")],
        input=json.dumps(command_lines(folder)),
        cwd=ROOT,
        env={name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")},
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return request.param, folder


def told(elsewhere: tuple[str, Path], *words: str) -> dict[str, Any]:
    """Returns the record of the command line that begins with these words."""
    lines = json.loads((elsewhere[1] / "told.json").read_text(encoding="utf-8"))
    (line,) = [line for line in lines if line["words"][: len(words)] == list(words) and line["words"][-1] != "--help"]
    return line


def test_a_session_is_simulated_and_recorded(elsewhere: tuple[str, Path]) -> None:
    line = told(elsewhere, "station", "run")
    assert line["status"] == 0, line["said"]
    assert "times faster than life" in line["said"]
    folder = elsewhere[1]
    recording = open_recording(folder / "session.mcap")
    assert len(list(recording.samples())) == 2
    assert not [path.name for path in folder.iterdir() if "partial" in path.name or "reserve" in path.name]


def test_what_is_measured_does_not_depend_on_the_system(elsewhere: tuple[str, Path], here: Path) -> None:
    assert digest(open_recording(elsewhere[1] / "session.mcap")) == digest(open_recording(here))


@pytest.fixture(scope="module")
def here(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("here") / "session.mcap"
    assert main(["run", "--lockstep", "--samples", "2", "--seed", "3", "--out", str(path)]) == 0
    return path


@pytest.mark.parametrize(
    ("command", "file", "words"),
    [
        ("samples", "samples.csv", "Onset angle by direction"),
        ("doctor", "session.mcap", "✓ no rule broken"),
        ("diagnose", "report.html", "onset"),
        ("replay", "view.rrd", "messages of"),
    ],
)
def test_the_session_can_be_worked_with(elsewhere: tuple[str, Path], command: str, file: str, words: str) -> None:
    line = told(elsewhere, "station", command)
    assert line["status"] == 0, line["said"]
    assert words in line["said"]
    assert (elsewhere[1] / file).stat().st_size > 100


def test_a_mistake_is_one_sentence_there_too(elsewhere: tuple[str, Path]) -> None:
    line = told(elsewhere, "station", "repair")
    assert line["status"] == 2
    assert "there is no file" in line["said"]
    assert "Traceback" not in line["said"]


def test_every_command_can_be_loaded(elsewhere: tuple[str, Path]) -> None:
    lines = json.loads((elsewhere[1] / "told.json").read_text(encoding="utf-8"))
    helps = [line for line in lines if line["words"][-1] == "--help"]
    assert len(helps) == len(list(COMMANDS.glob("[a-z]*.py")))
    assert [(line["words"], line["said"]) for line in helps if line["status"] != 0] == []


def test_shared_system_keeps_its_promises(elsewhere: tuple[str, Path]) -> None:
    line = told(elsewhere, "pytest")
    assert line["status"] == 0, line["said"]


def test_only_shared_system_asks_which_system_it_is() -> None:
    asks = re.compile(
        r"sys\.platform|os\.name\b|platform\.system|SIGUSR|SIGKILL|SIGHUP|sched_|posix_fallocate|start_new_session"
        rf"|creationflags|os\.fork|os\.getuid|import ({'|'.join((*ABSENT_ON_WINDOWS, 'msvcrt', 'winreg'))})\b"
    )
    found = [
        place
        for package in ("station", "shared", "pi_agent")
        for path in sorted((ROOT / package).rglob("*.py"))
        if not (place := path.relative_to(ROOT).as_posix()).startswith(("shared/system/", *LINUX_ONLY))
        and asks.search(path.read_text(encoding="utf-8"))
    ]
    assert found == ["station/arm/drivers/ros1.py"]  # ROS 1 is for Linux alone
