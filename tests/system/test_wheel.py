"""The wheel, in an environment that never saw the checkout: its data, its commands, and what they say they lack."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from collections.abc import Collection
from pathlib import Path

import pytest

from shared.installed import DISTRIBUTION
from tests.patience import PATIENCE_S
from tests.system.ports import free_port

ROOT = Path(__file__).parents[2]
PACKAGES = ("pi_agent", "shared", "station")
VIEW, TABLES, ARM = {"rerun", "rerun_cli"}, {"pandas", "pyarrow"}, {"ssik"}
OTHERS = {"rosbags", "natnet", "pymavlink", "serial", "cryptography"}
ELSEWHERE, MESHES = {"aiohttp", "fsspec", "s3fs", "dask", "distributed"}, {"collada", "trimesh"}
BEYOND_STATION = VIEW | TABLES | ARM | OTHERS | ELSEWHERE | MESHES
"""The imports from the extras beside `station`; test_installed.py compares pyproject.toml with all imports."""
STATION = {"joblib", "lz4", "matplotlib", "mcap", "mujoco", "numba", "rich", "scipy", "tomli_w", "zstandard"}
# The environment sees the packages of this one, less those named in LACKING, as if they were not installed.
USES_NUMBA = "from station.compiled import"
LACKING = """\
import os, sys
class Lacking:
    names = set(filter(None, os.environ.get("LACKING", "").split(",")))
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in self.names:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Lacking())
"""
ASK_ALL = """\
import contextlib, io, json, pathlib, station.__main__ as command
answers = {}
for path in sorted(command.COMMANDS.glob("[a-z]*.py")):
    said = io.StringIO()
    words = (command._constant(path, "NAME") or path.stem).split()
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
        try:
            status = command.main([*words, "--help"])
        except SystemExit as end:
            status = end.code
    answers[" ".join(words)] = status, said.getvalue()
print(json.dumps(answers))
"""
ONE_OTHER = """\
import os, sys, time
from pathlib import Path
from shared.messages import MarkerCorners, RunEvent
from shared.rig import load_rig
from shared.zenoh_bus import ZenohBus
rig, heard = load_rig(Path("rig.toml")), []
with ZenohBus.of("station", rig) as station:
    station.subscribe("**", lambda received: heard.append(received.topic))
    os.environ["REPOSE_KEYS"] = sys.argv[1]
    with ZenohBus("wheel", connect=rig.bus.endpoint("station")) as other:
        end = time.monotonic() + float(sys.argv[2])
        while "camera/corners" not in heard and time.monotonic() < end:
            other.publish("session/event", RunEvent(1, 1, "SYNC"))  # the station's own to send
            other.publish("camera/corners", MarkerCorners(capture_ns=1))
            station.poll(0.1)
print(sorted(set(heard)))
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    run([sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)], ROOT)
    return next(folder.glob("*.whl"))


@pytest.fixture(scope="module")
def programs(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the commands that the wheel installs."""
    venv = tmp_path_factory.mktemp("installed") / "venv"
    run([sys.executable, "-m", "venv", "--without-pip", str(venv)], venv.parent)
    programs = next(path for name in ("bin", "Scripts") if (path := venv / name).is_dir())
    words = ["install", "--quiet", "--no-deps", "--no-index", "--no-compile", str(wheel)]
    run([sys.executable, "-m", "pip", "--python", str(next(programs.glob("python*"))), *words], venv.parent)
    site = next(venv.rglob("site-packages"))
    here = [path for path in sys.path if Path(path).name == "site-packages"]
    (site / "this_environment.pth").write_text("\n".join([*here, "import _lacking", ""]))
    (site / "_lacking.py").write_text(LACKING)
    return programs


def run(words: list[str], folder: Path, *, lacking: Collection[str] = (), home: str = "", status: int = 0) -> str:
    """Returns what a command prints in a folder, its home too; nothing in the environment leads to the checkout."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "XDG_", "NUMBA_"))}
    environment = {**kept, "HOME": home or str(folder), "LACKING": ",".join(sorted(lacking))}
    done = subprocess.run(
        words,
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert done.returncode == status, done.stdout
    return done.stdout


def test_the_wheel_holds_every_file_of_the_packages_and_their_types(wheel: Path):
    with zipfile.ZipFile(wheel) as archive:
        held = {name for name in archive.namelist() if not name.startswith(f"{DISTRIBUTION.replace('-', '_')}-")}
    files = (path.relative_to(ROOT) for package in PACKAGES for path in (ROOT / package).rglob("*") if path.is_file())
    assert held == {path.as_posix() for path in files if "__pycache__" not in path.parts}
    assert {f"{package}/py.typed" for package in PACKAGES} <= held


@pytest.mark.parametrize(
    ("lacking", "extras"),
    [(BEYOND_STATION, {"keys", "view"}), (STATION | BEYOND_STATION, {"keys", "station"})],
    ids=["station", "base"],
)
def test_a_command_without_its_extra_says_one_sentence(
    programs: Path, tmp_path: Path, lacking: set[str], extras: set[str]
):
    answers: dict[str, tuple[int, str]] = json.loads(
        run([str(programs / "python"), "-c", ASK_ALL], tmp_path, lacking=lacking)
    )
    named: set[str] = set()
    for command, (status, said) in answers.items():
        assert (status == 0) == (not said), (command, said)
        if said:
            assert status == 2, (command, said)
            assert said.count("\n") == 1, (command, said)
            assert said.startswith(f"station {command}: Expected the package "), said
            named.add(said.partition(f'pip install "{DISTRIBUTION}[')[2].partition("]")[0])
    assert named == extras
    assert any(status == 0 for status, _ in answers.values())


def test_the_camera_agent_needs_no_extra(programs: Path, tmp_path: Path):
    base = STATION | BEYOND_STATION
    for words in (["--help"], ["--version"], ["track", "--help"], ["calibrate", "--help"]):
        run([str(programs / "pi-agent"), *words], tmp_path, lacking=base)
    assert run([str(programs / "station"), "--version"], tmp_path, lacking=base).startswith("station ")
    assert "usage: station" in run([str(programs / "station"), "--help"], tmp_path, lacking=base)


def test_keys_of_the_installed_commands_let_each_process_send_what_is_its_own(programs: Path, tmp_path: Path):
    (tmp_path / "rig.toml").write_text(f'id = "wheel"\n[bus]\nstation = "tls/127.0.0.1:{free_port()}"\n')
    for folder in ("keys", "foreign"):
        run([str(programs / "station"), "keys", "new", "--rig", "rig.toml", "--out", folder], tmp_path)
    python = str(next(programs.glob("python*")))
    for keys, patience_s, heard in (("keys/camera", PATIENCE_S, ["camera/corners"]), ("foreign/camera", 3.0, [])):
        said = run([python, "-c", ONE_OTHER, keys, str(patience_s)], tmp_path)
        assert said.splitlines()[-1] == str(heard), said


def test_the_station_measures_and_analyses_with_its_own_extra_and_a_home_that_cannot_be_written(
    programs: Path, tmp_path: Path
):
    compiled = {path.parent for path in programs.parent.rglob("*.py") if USES_NUMBA in path.read_text("utf-8")}
    assert compiled
    for folder in compiled:
        (folder / "__pycache__").touch()  # no folder can be made there, not even by root

    def station(*words: str, status: int = 0) -> str:
        return run(
            [str(programs / "station"), *words], tmp_path, lacking=BEYOND_STATION, home=os.devnull, status=status
        )

    station("run", "--lockstep", "--samples", "2", "--out", "a.mcap")
    assert "2" in station("samples", "a.mcap", "--csv", "a.csv")
    station("doctor", "a.mcap")
    assert station("samples", "a.mcap", "--parquet", "a.parquet", status=2).endswith(f'"{DISTRIBUTION}[parquet]"\n')
    said = station("analyze", "a.mcap", "--out", "out", status=1)
    assert "Matplotlib" not in said  # it would warn of its cache
    assert said.count("A file is left out") == 2
    assert "expected at least 20 runs" in station("diagnose", "a.mcap")
    assert (tmp_path / "out" / "report.html").exists()
