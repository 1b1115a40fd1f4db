"""Every pinned dependency has a wheel for the Pi that goes with the system's own NumPy, and wheels are checked."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from shared.errors import UserError
from station.app.deploy.locks import normal, read_lock
from station.app.deploy.systems import SYSTEMS, System
from station.app.deploy.wheels import find_wheels, unpack

UNREACHABLE = ("Connection", "connection", "timed out", "resolve", "ProxyError", "SSLError")


def resolve_for(system: System, folder: Path) -> list[dict[str, str]]:
    """Returns what pip would install on the system, of wheels alone; nothing is installed, only metadata is read."""
    wanted = [f"{pin.name}=={pin.version}" for pin in read_lock(system.lock)] + [f"numpy=={system.numpy}"]
    words = [sys.executable, "-m", "pip", "install", "--dry-run", "--ignore-installed", "--report", "-", "--quiet"]
    words += ["--retries", "0", "--timeout", "20", "--disable-pip-version-check", "--target", str(folder)]
    words += ["--only-binary", ":all:", "--implementation", "cp", "--python-version", ".".join(map(str, system.python))]
    words += [word for tag in system.platforms for word in ("--platform", tag)]
    words += [word for tag in (system.abi, "abi3", "none") for word in ("--abi", tag)]
    done = subprocess.run([*words, *wanted], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        if any(word in done.stderr for word in UNREACHABLE) and "deploy" not in os.environ.get("REPOSE_REQUIRE", ""):
            pytest.skip("the package index cannot be reached")
        pytest.fail(done.stderr)
    report = json.loads(done.stdout)
    return [
        {
            "name": normal(item["metadata"]["name"]),
            "sha256": item["download_info"]["archive_info"]["hashes"]["sha256"],
            "file": item["download_info"]["url"].rpartition("/")[2],
        }
        for item in report["install"]
    ]


@pytest.mark.parametrize("system", SYSTEMS.values(), ids=lambda system: system.codename)
def test_every_pin_has_an_aarch64_wheel_that_goes_with_the_systems_numpy(system: System, tmp_path: Path):
    found = {item["name"]: item for item in resolve_for(system, tmp_path)}
    pins = {pin.name: pin for pin in read_lock(system.lock)}
    assert set(found) == set(pins) | {"numpy"}, "nothing else is needed"
    for name, pin in pins.items():
        assert "aarch64" in found[name]["file"]
        assert found[name]["sha256"] in pin.hashes


@pytest.mark.parametrize("system", SYSTEMS.values(), ids=lambda system: system.codename)
def test_the_pis_dependencies_are_few_and_leave_its_numpy_alone(system: System):
    assert {pin.name for pin in read_lock(system.lock)} == {"eclipse-zenoh", "opencv-python-headless", "protobuf"}


def test_bookworm_keeps_an_opencv_from_before_numpy_2():
    versions = {pin.name: pin.version for pin in read_lock(SYSTEMS["bookworm"].lock)}
    assert tuple(map(int, versions["opencv-python-headless"].split(".")[:2])) < (4, 12)


@pytest.mark.parametrize("line", ["numpy>=2", "numpy==2.2.4", "-e ."])
def test_a_lock_that_does_not_pin_is_refused(tmp_path: Path, line: str):
    (tmp_path / "a.lock").write_text(line + "\n")
    with pytest.raises(UserError, match="expected lines of"):
        read_lock(tmp_path / "a.lock")


def make_wheel(folder: Path, members: dict[str, str]) -> Path:
    wheel = folder / "some_thing-1.0-py3-none-any.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        for name, text in members.items():
            archive.writestr(name, text)
    lock = folder / "a.lock"
    lock.write_text(f"some-thing==1.0 --hash=sha256:{hashlib.sha256(wheel.read_bytes()).hexdigest()}\n")
    return wheel


def test_wheels_are_unpacked_as_pip_would_less_their_scripts(tmp_path: Path):
    members = {
        "some_thing/a.py": "a",
        "some_thing-1.0.data/platlib/some_thing/b.py": "b",
        "some_thing-1.0.data/scripts/run": "c",
        "some_thing-1.0.dist-info/METADATA": "d",
    }
    wheel = make_wheel(tmp_path, members)
    assert find_wheels(tmp_path / "a.lock", tmp_path) == [wheel]
    unpack([wheel], tmp_path / "site")
    files = {str(path.relative_to(tmp_path / "site")) for path in (tmp_path / "site").rglob("*") if path.is_file()}
    assert files == {"some_thing/a.py", "some_thing/b.py", "some_thing-1.0.dist-info/METADATA"}


def test_a_wheel_that_writes_elsewhere_is_refused(tmp_path: Path):
    wheel = make_wheel(tmp_path, {"../outside.py": "x"})
    with pytest.raises(UserError, match="paths inside the wheel"):
        unpack([wheel], tmp_path / "site")
    assert not (tmp_path / "outside.py").exists()


def test_a_missing_wheel_says_how_to_get_it(tmp_path: Path):
    wheel = make_wheel(tmp_path, {"a.py": ""})
    wheel.unlink()
    with pytest.raises(UserError, match=r"some-thing 1\.0 .* got none: run `station deploy --prepare`"):
        find_wheels(tmp_path / "a.lock", tmp_path)
