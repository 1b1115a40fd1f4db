"""The wheels of a lock: fetched onto the laptop once, checked against their hashes, unpacked without pip."""

from __future__ import annotations

import hashlib
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

from shared.errors import UserError
from station.app.deploy.locks import Pin, normal, read_lock
from station.app.deploy.systems import System

CACHE = Path.home() / ".cache" / "repose" / "wheels"


def wheel_folder(system: System) -> Path:
    """Returns the folder of a system's wheels on this laptop."""
    return CACHE / system.codename


def find_wheels(lock: Path, folder: Path) -> list[Path]:
    """Finds the wheel of every pin, each with a hash that the lock allows.

    Raises:
        UserError: naming the first that is missing, or whose content is not the pinned one.
    """
    return [_wheel_of(pin, folder) for pin in read_lock(lock)]


def _wheel_of(pin: Pin, folder: Path) -> Path:
    files = sorted(folder.glob("*.whl")) if folder.is_dir() else []
    named = [file for file in files if _is(file, pin)]
    for file in named:
        if hashlib.sha256(file.read_bytes()).hexdigest() in pin.hashes:
            return file
    wrong = f"only {named[0].name}, which is not the pinned file (its hash differs)" if named else "none"
    raise UserError(
        f"Expected a wheel of {pin.name} {pin.version} in {folder}, got {wrong}: "
        "run `station deploy --prepare` for the Pi's system where there is internet"
    )


def _is(file: Path, pin: Pin) -> bool:
    name, version, *_ = file.name.split("-")
    return normal(name) == pin.name and version == pin.version


def fetch(lock: Path, folder: Path, system: System) -> list[Path]:
    """Downloads what is missing, and only wheels for the system's Python on aarch64; gives all wheels.

    Raises:
        UserError: if a pinned dependency has no such wheel or the package index cannot be reached.
    """
    try:
        return find_wheels(lock, folder)
    except UserError:
        folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        done = subprocess.run(_pip_download(lock, Path(scratch), system), capture_output=True, text=True, check=False)
        if done.returncode != 0:
            reason = next((line for line in done.stderr.splitlines() if "ERROR" in line), done.stderr.strip()[-300:])
            raise UserError(f"Expected aarch64 wheels for {lock.name} from the package index, but pip says: {reason}")
        for wheel in Path(scratch).glob("*.whl"):
            shutil.move(wheel, folder / wheel.name)
    return find_wheels(lock, folder)


def _pip_download(lock: Path, folder: Path, system: System) -> list[str]:
    words = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check", "--no-deps"]
    words += ["--require-hashes", "--only-binary", ":all:", "--dest", str(folder), "--requirement", str(lock)]
    words += ["--python-version", ".".join(map(str, system.python)), "--implementation", "cp"]
    for tag in system.platforms:
        words += ["--platform", tag]
    return [*words, "--abi", system.abi, "--abi", "abi3", "--abi", "none"]


def unpack(wheels: list[Path], site: Path) -> None:
    """Unpacks wheels into a site-packages folder: what pip does, less its scripts, which the agent does not use.

    Raises:
        UserError: if a wheel would write outside the folder.
    """
    site.mkdir(parents=True, exist_ok=True)
    for wheel in wheels:
        with zipfile.ZipFile(wheel) as archive:
            for member in archive.infolist():
                inside = _place_in_site(member.filename)
                if inside is None or member.is_dir():
                    continue
                target = (site / inside).resolve()
                if not target.is_relative_to(site.resolve()):
                    raise UserError(f"{wheel}: expected paths inside the wheel, got '{member.filename}'")
                target.parent.mkdir(parents=True, exist_ok=True)
                with archive.open(member) as source, target.open("wb") as sink:
                    shutil.copyfileobj(source, sink)


def _place_in_site(name: str) -> str | None:
    """Returns the path of a wheel's member; None for scripts, headers and data."""
    first, _, rest = name.partition("/")
    if not first.endswith(".data"):
        return name
    kind, _, inner = rest.partition("/")
    return inner if kind in {"purelib", "platlib"} else None
