"""Every line of shell in every README, in the order of reading, in a folder like the reader's.

Most lines are run as they stand, on a short session. Those in ELSEWHERE are only read, by the real parser of their
command, and the files that they take must be there: another test runs what they start. Of `make`, of pytest and of the
generators it is looked up that what is asked for exists; what is installed must name extras of ours. A line that
nothing here knows fails.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import importlib.util
import io
import re
import runpy
import shlex
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest

from pi_agent.__main__ import main as pi_agent
from pi_agent.calibration import command as calibration
from pi_agent.page import command as camera_page
from station.__main__ import commands, examples
from station.__main__ import main as station
from tests.readmes.blocks import ROOT, blocks
from tests.readmes.reader import furnish, write_twenty_runs
from tests.unit.diagnosis.asked_once import ask_once

ELSEWHERE = {
    "station rig": "starts all processes of a rig: tests/system/test_rig.py",
    "station demo": "a minute: tests/unit/app/test_demo.py runs a shorter one",
    "station twin": "runs until it is stopped: tests/system/test_rig.py",
    "station angles": "runs until it is stopped: tests/system/test_angle_comparison.py",
    "station arm stop": "needs an arm agent: tests/system/test_arm_process.py",
    "station deploy": "needs a Pi: tests/system/test_deploy.py deploys through a real sshd",
    "station arm --rig": "runs until it is stopped: tests/system/test_arm_process.py",
    "station run --rig": "needs the other processes of a rig: tests/system/test_rig.py",
    "station replay --live": "needs a session that is running: tests/system/test_view_bus.py",
    "station notify": "needs a receiver: tests/unit/notify/test_watch.py has one",
    "station study": "6330 samples: tests/recovery/test_study.py does twenty",
    "station serve": "runs until it is stopped: tests/system/test_page.py",
    "station diagnose sim.mcap --simulate mujoco": "every run again in MuJoCo: tests/unit/diagnosis/test_report.py",
    "station diagnose session.mcap --simulate scene.xml": "half a minute: tests/recovery/test_given_simulation.py",
    "station diagnose session.mcap --simulate my_sim.py:other": "likewise: tests/unit/simulators/test_yours.py",
    "station diagnose session.mcap --simulate my_sim --plugins mine": "likewise: tests/unit/app/test_plugins.py",
    "station samples s3://": "needs a bucket: tests/unit/many/test_remote.py has a web server and a store in memory",
    "station diagnose recordings/ --out diagnoses/ --backend": "needs a cluster: tests/system/test_cluster.py",
    "deploy/deploy.sh": "needs a Pi: tests/system/test_deploy.py deploys through a real sshd",
    "pi-agent calibrate": "needs a camera: tests/unit/pi_agent/test_calibration.py",
    "pi-agent serve": "runs until it is stopped: tests/system/test_camera_page.py",
    "station replay sim.mcap --moving": "a minute of drawing: tests/unit/app/test_moving.py draws less",
    "uv tool install": "tests/system/test_wheel.py installs and uses the wheel",
    "pipx install": "likewise",
    "apt-get install chrony": "changes the clock of this machine",
    "printf 'allow": "likewise",
    "deploy/test_in_arm64.sh": "emulates another processor for forty minutes",
    "deploy/test_virtual_camera.sh": "builds and boots an emulated computer, as root",
    "deploy/test_image.sh": "installs Debian and the station anew, as root",
}
"""Lines that are read and not run, with the reason or the test that runs what they start."""

SHORTER = {
    "--samples 500": "--samples 3",
    "station record": "station record --seconds 0.5",
    "replay --bus": "replay --speed 1000 --bus",
    "compare-angles": "compare-angles --sweeps 1 --step-deg 5 --readings 3",
    "diagnose sim.mcap --report": "diagnose twenty.mcap --report",
    "diagnose session.mcap --overlay": "diagnose twenty.mcap --overlay",
    "--simulate mine.mcap": "--simulate session.mcap",
    "session.mcap --simulate my_sim.py": "twenty.mcap --simulate my_sim.py",
}
"""The same for less time."""

FINDS = {
    "station analyze sim.mcap --out report": 1,
    'station analyze "recordings/*.mcap" --out report': 1,
    "station doctor recordings/": 1,
}
"""Exit status 1 of `analyze` says that three slides are too few to test anisotropy, of `doctor` that the session which
was recorded in simulated time lacks topics of a live one."""

MADE = "--out --moving --csv --parquet --report --overlay --model --keyout"
"""Options before the name of a file that the line makes."""

WORKED = set[tuple[str | bytes, ...]]()
"""Diagnoses that have worked and write nothing, with the digests of the files that they name. One of the same line on
the same bytes on another page is the same diagnosis, and takes half a minute."""


def lines() -> list[tuple[str, str]]:
    """Page and line, without the comment at its end; the last page is the examples of `--help` that no README has."""
    shown = [(block.readme, re.sub(r"\s+#\s.*$", "", line)) for block in blocks("sh") for line in block.lines()]
    known = {line for _, line in shown}
    return shown + [("--help", line) for line in examples() if line not in known]


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("readmes")


@pytest.fixture(autouse=True)
def _each_question_is_answered_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Several lines diagnose the same recording, and each makes something else of the answer."""
    ask_once(monkeypatch)


@pytest.fixture
def here(folders: Path, readme: str, line: str, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The README's folder, with what its lines take from elsewhere; later lines find what earlier ones made."""
    folder = folders / readme.replace("/", "-")
    if not folder.exists():
        furnish(folder)
    monkeypatch.chdir(folder)
    return folder


@pytest.mark.parametrize(("readme", "line"), lines())
def test_it_works_as_it_stands(readme: str, line: str, here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = next(word for word in line.split() if "=" not in word)
    kinds = {name: action for name, action in PROGRAMS.items() if program.endswith(name)}
    assert kinds, f"no test knows the program of this line of {readme}: {line}"
    next(iter(kinds.values()))(line, monkeypatch)


def _ours(line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A command of Repose: run, or parsed by its own parser."""
    if any(line.startswith(start) for start in ELSEWHERE):
        _parsed(line, monkeypatch)
        return
    for long, short in SHORTER.items():
        line = line.replace(long, short)
    if " repair " in line:  # as a kill leaves it
        whole = Path("sim.mcap").read_bytes()
        Path("killed.mcap.partial").write_bytes(whole[: len(whole) * 2 // 3])
    if "twenty.mcap" in line and not Path("twenty.mcap").exists():
        write_twenty_runs(Path("twenty.mcap"))
    program, *words = shlex.split(line)
    again = (line, *(hashlib.sha256(Path(word).read_bytes()).digest() for word in words if Path(word).is_file()))
    if again in WORKED:
        return
    assert (station if program == "station" else pi_agent)(words) == FINDS.get(line, 0)
    if program == "station" and words[0] == "diagnose" and not set(words) & set(MADE.split()):
        WORKED.add(again)


def _parsed(line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    program, *words = shlex.split(line)
    for option, name in pairwise(words):
        if Path(name).suffix in {".toml", ".mcap", ".csv"} and option not in MADE.split():
            assert Path(name).is_file(), f"nothing has made {name}"
    if program == "pi-agent":
        monkeypatch.setattr(calibration, "run", _nothing)
        monkeypatch.setattr(camera_page, "run", _nothing)
        assert pi_agent(words) == 0
        return
    file = commands().get(" ".join(words[:2])) or commands()[words[0]]
    command = importlib.import_module(f"station.app.commands.{file.stem}")
    monkeypatch.setattr(command, "run", _nothing)
    assert station(words) == 0


def _nothing(_options: object) -> int:
    return 0


def _deploy(line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """deploy.sh is `station deploy` (tests/unit/deploy/test_command.py)."""
    _parsed(line.replace("deploy/deploy.sh", "station deploy"), monkeypatch)


def _copied(line: str, _monkeypatch: pytest.MonkeyPatch) -> None:
    """The copy is a rig file; the one that the commands get is the simulated rig's, which has no Pi."""
    kept = Path("rig.toml").read_bytes()
    _in_a_shell(line, _monkeypatch)
    assert tomllib.loads(Path("rig.toml").read_text(encoding="utf-8"))["id"]
    Path("rig.toml").write_bytes(kept)


def _in_a_shell(line: str, _monkeypatch: pytest.MonkeyPatch) -> None:
    program = line.partition(" ")[0]
    if shutil.which(program) is None:
        pytest.skip(f"no {program} here: apt-get install {program}")
    done = subprocess.run(["bash", "-c", line], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def _activated(line: str, _monkeypatch: pytest.MonkeyPatch) -> None:
    """The environment's own script, wherever the tests' environment lies; then both commands are found in it."""
    script = Path(sys.prefix) / "bin" / "activate"
    if not script.exists():
        pytest.skip("the tests run in no virtual environment")
    words = f"{line.replace('.venv/bin/activate', shlex.quote(str(script)))} && command -v station pi-agent"
    done = subprocess.run(["bash", "-c", words], capture_output=True, text=True, check=True)
    assert [Path(found).parent for found in done.stdout.split()] == [script.parent] * 2
    told = subprocess.run(["make", "-n", "run"], cwd=ROOT, capture_output=True, text=True, check=True)
    assert line in told.stdout, "`make run` ends with the same line"


def _made(line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Checks what make would do; the commands of `make run` are read by their parsers, and run by other tests."""
    done = subprocess.run(["make", "-n", *shlex.split(line)[1:]], cwd=ROOT, capture_output=True, text=True, check=True)
    for command in re.findall(r"\.venv/bin/(station (?:rig|demo)[^|\n]*)", done.stdout):
        _parsed(command, monkeypatch)


def _installed(line: str, _monkeypatch: pytest.MonkeyPatch) -> None:
    """The checkout with extras that there are; tests/system/test_wheel.py installs and uses what comes of them."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    place, _, extras = shlex.split(line)[-1].rstrip("]").partition("[")
    assert place == "."
    assert set(extras.split(",")) <= set(project["optional-dependencies"])


def _tests(line: str, _monkeypatch: pytest.MonkeyPatch) -> None:
    named = [word for word in shlex.split(line) if word.startswith("tests/")]
    assert named
    assert all((ROOT / name).exists() for name in named)


def _script(line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    _in_a_shell(f"bash -n {line}", monkeypatch)


def _shell_only_reads(line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    _in_a_shell(f"bash -n -c {shlex.quote(line)}", monkeypatch)


def _python(line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file that an earlier line has exported runs as it stands; all others are the generators'."""
    made = Path(shlex.split(line)[1])
    if made.parts[0] != "export":
        _generator(line, monkeypatch)
        return
    engine = ENGINES[made.stem.rpartition("_")[2]]
    if importlib.util.find_spec(engine) is None:
        pytest.skip(f"no {engine} here: pip install --group engines")
    done = subprocess.run([sys.executable, str(made)], capture_output=True, text=True, check=True)
    assert done.stdout.count("degrees of tilt") == 4


ENGINES = {"numpy": "numpy", "mujoco": "mujoco", "pybullet": "pybullet", "drake": "pydrake"}
"""The package that an exported file needs, by the end of its name."""


def _generator(line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The line is a form to fill in: each of its options is one; tests/unit makes cases with it."""
    _, option, module, *_ = shlex.split(line)
    assert option == "-m"
    told = io.StringIO()
    monkeypatch.setattr(sys, "argv", [module, "--help"])
    # Python warns of a module that is run a second time, so the one that another test has imported is set aside.
    for name in (module, f"{module}.__main__"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    with contextlib.redirect_stdout(told), pytest.raises(SystemExit, match=r"^0$"):
        runpy.run_module(module, run_name="__main__", alter_sys=True)
    assert set(re.findall(r"--[a-z]+", line)) <= set(re.findall(r"--[a-z]+", told.getvalue()))


PROGRAMS: dict[str, Callable[[str, pytest.MonkeyPatch], None]] = {
    "station": _ours,
    "pi-agent": _ours,
    "deploy.sh": _deploy,
    "test_in_arm64.sh": _script,
    "test_virtual_camera.sh": _script,
    "test_image.sh": _script,
    "cp": _copied,
    "openssl": _in_a_shell,
    "make": _made,
    "uv": _installed,
    "pipx": _installed,
    "apt-get": _shell_only_reads,
    "printf": _shell_only_reads,
    "pytest": _tests,
    "python": _python,
    ".": _activated,
    "export": _shell_only_reads,
}


@pytest.mark.parametrize("start", ELSEWHERE)
def test_what_is_not_run_is_in_a_page_and_run_by_the_test_that_is_named(start: str) -> None:
    assert any(line.startswith(start) for _, line in lines())
    assert all((ROOT / name).exists() for name in re.findall(r"tests/\S+\.py", ELSEWHERE[start]))
