"""`make setup` refuses in one sentence what cannot work, before it fetches anything."""

from __future__ import annotations

import os
import re
import shutil
import socket
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from tests.patience import PATIENCE_S

ROOT = Path(__file__).parents[3]
# Answers as a Python of another version, processor or C library would, and is this one in everything else.
FAKE = """#!/bin/sh
case "$2" in
  *version_info*) printf '{version}' ;;
  *sys.maxsize*) printf '{machine}' ;;
  *libc_ver*) printf '{libc}' ;;
  *) exec {python} "$@" ;;
esac
"""


def script(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    path.chmod(0o755)
    return path


def fake_python(folder: Path, *, version: str = "3.11", machine: str = "x86_64", libc: str = "linux glibc") -> Path:
    text = FAKE.format(version=version, machine=machine, libc=libc, python=sys.executable)
    return script(folder / "python", text)


def set_up(python: Path | str, venv: Path | str, **environment: str) -> tuple[int, str]:
    """The exit status of the set-up and what it says; beyond these checks it would install everything."""
    words = ["sh", "deploy/prepare.sh", str(python), str(venv), "requirements.lock"]
    done = subprocess.run(
        words,
        cwd=ROOT,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    return done.returncode, done.stdout + done.stderr


def refused(answer: tuple[int, str], *said: str) -> None:
    status, text = answer
    assert status == 1, text
    assert text.count("\n") == 1
    assert text.startswith("make setup: Expected ")
    for part in said:
        assert part in text


@pytest.mark.parametrize("version", ["2.7", "3.6", "3.10", "3.15"])
def test_a_python_without_wheels_is_refused(version: str, tmp_path: Path):
    refused(set_up(fake_python(tmp_path, version=version), tmp_path / "venv"), version, "make PYTHON=")
    assert not (tmp_path / "venv").exists()


def test_a_python_that_is_not_there_is_refused(tmp_path: Path):
    refused(set_up(tmp_path / "none", tmp_path / "venv"), f"found no {tmp_path / 'none'}")


@pytest.mark.parametrize("machine", ["riscv64", "32-bit armv7l"])
def test_a_processor_for_which_all_must_be_compiled_is_refused(machine: str, tmp_path: Path):
    refused(set_up(fake_python(tmp_path, machine=machine), tmp_path / "venv"), machine, "compiled")


def test_another_c_library_is_refused(tmp_path: Path):
    refused(set_up(fake_python(tmp_path, libc="linux no glibc"), tmp_path / "venv"), "glibc")


def test_no_permission_to_write_is_refused(tmp_path: Path):
    (tmp_path / "file").touch()  # nobody can make a folder below a file, root neither
    refused(set_up(fake_python(tmp_path), tmp_path / "file" / "venv"), "not allowed", "make VENV=")


def test_a_full_disk_is_refused(tmp_path: Path):
    script(tmp_path / "df", "#!/bin/sh\nprintf 'head\\n/dev/x 9 9 2048000 9%% /\\n'\n")
    path = f"{tmp_path}{os.pathsep}{os.environ['PATH']}"
    refused(set_up(fake_python(tmp_path), tmp_path / "venv", PATH=path), "got 2000 MB")


def nobody_listens() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def made_venv(folder: Path) -> Path:
    """A stand-in for an environment that was made before: it has this one's pip."""
    (folder / "bin").mkdir(parents=True)
    script(folder / "bin" / "python", f'#!/bin/sh\nexec {sys.executable} "$@"\n')
    return folder


def test_a_package_index_that_does_not_answer_is_refused(tmp_path: Path):
    index = f"http://127.0.0.1:{nobody_listens()}/simple"
    nothing = {"PIP_CONFIG_FILE": os.devnull, "PIP_EXTRA_INDEX_URL": "", "PIP_FIND_LINKS": "", "PIP_NO_CACHE_DIR": "1"}
    answer = set_up(
        fake_python(tmp_path), made_venv(tmp_path / "venv"), PIP_INDEX_URL=index, HOME="/dev/null", **nothing
    )
    refused(answer, "package index", "PIP_INDEX_URL")


def make_wheel(path: Path, version: str) -> None:
    info = f"iniconfig-{version}.dist-info"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(f"{info}/METADATA", f"Metadata-Version: 2.1\nName: iniconfig\nVersion: {version}\n")
        archive.writestr(f"{info}/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n")
        archive.writestr(f"{info}/RECORD", "")


TOOLS = ("sh", "awk", "cat", "df", "dirname", "grep", "mkdir", "printf", "rm", "tail")
"""All the programs that the set-up calls besides Python; no compiler is among them."""


def without_a_compiler(folder: Path) -> str:
    """A search path on which there is nothing but those programs."""
    folder.mkdir()
    for found in filter(None, map(shutil.which, TOOLS)):
        (folder / Path(found).name).symlink_to(found)
    return str(folder)


def test_nothing_is_compiled():
    """Whatever pip installs is a wheel, or this project itself, for which the set-up has brought the builder."""
    done = subprocess.run(["make", "-B", "-n", "setup"], cwd=ROOT, capture_output=True, text=True, check=True)
    installs = re.findall(r"pip install .*", done.stdout.replace("\\\n", ""))
    assert len(installs) == 2
    for words in installs:
        assert "--only-binary :all:" in words or "--no-build-isolation --editable ." in words


def test_all_that_is_checked_can_be_met_without_a_compiler_and_with_a_home_that_cannot_be_written(tmp_path: Path):
    wheels = tmp_path / "wheels"
    wheels.mkdir()
    pin = next(line for line in (ROOT / "requirements.lock").read_text().splitlines() if line.startswith("iniconfig=="))
    version = pin.split()[0].partition("==")[2]
    make_wheel(wheels / f"iniconfig-{version}-py3-none-any.whl", version)
    venv = made_venv(tmp_path / "venv")
    path = without_a_compiler(tmp_path / "path")
    offline = {"PIP_NO_INDEX": "1", "PIP_FIND_LINKS": str(wheels)}
    answer = set_up(fake_python(tmp_path), venv, PATH=path, CC="/bin/false", HOME="/dev/null", **offline)
    assert answer == (0, "")
