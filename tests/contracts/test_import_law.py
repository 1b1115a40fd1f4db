"""The floors of the house say who may import whom."""

import importlib
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.patience import PATIENCE_S

ROOT = Path(__file__).parents[2]
DOORS = {
    "zenoh": ("shared/zenoh_bus.py",),
    "mcap": ("station/recording/",),
    "rerun": ("station/view/",),
    # A deployment tries on the Pi whether the import works there.
    "picamera2": ("pi_agent/cameras/pi_camera.py", "station/app/deploy/target/smoke.py"),
    "joblib": ("station/pool.py",),
    "distributed": ("station/cluster.py",),
    "fsspec": ("station/app/many/remote.py",),
    "mujoco": ("station/simulators/mujoco/", "station/arm/"),
    "rospy": ("station/arm/drivers/",),
    "pymavlink": ("station/angles/sources/",),
    "natnet": ("station/angles/sources/",),
    "serial": ("shared/byte_links.py",),
}


def sources() -> list[Path]:
    return [path for package in ("pi_agent", "station", "shared") for path in (ROOT / package).rglob("*.py")]


def test_the_floors_of_the_house():
    importlib.import_module("importlinter")
    done = subprocess.run(
        [sys.executable, "-c", "from importlinter.cli import lint_imports_command; lint_imports_command()"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("package", sorted(DOORS))
def test_each_foreign_package_has_one_door(package: str):
    pattern = re.compile(rf"^\s*(import|from) {package}\b", re.MULTILINE)
    users = [str(path.relative_to(ROOT)) for path in sources() if pattern.search(path.read_text(encoding="utf-8"))]
    assert [user for user in users if not user.startswith(DOORS[package])] == []


def test_physics_and_diagnosis_have_no_files_clock_or_bus():
    pattern = re.compile(
        r"^\s*(import|from) (time|pathlib|shared\.bus|shared\.zenoh_bus|shared\.clock)\b", re.MULTILINE
    )
    files = [path for name in ("physics", "diagnosis") for path in (ROOT / "station" / name).rglob("*.py")]
    assert {path.relative_to(ROOT).parts[1] for path in files} == {"physics", "diagnosis"}
    users = [path for path in files if pattern.search(path.read_text("utf-8"))]
    # The catalogue imports the files of a folder that the rig file names: it looks for plug-ins, not for data.
    assert [path for path in users if path != ROOT / "station" / "physics" / "catalogue.py"] == []
