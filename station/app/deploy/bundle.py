"""A release as it goes to the target: code, rig file, keys, unit. Its id is its content's hash, so equal is equal."""

from __future__ import annotations

import dataclasses
import gzip
import hashlib
import io
import json
import subprocess
import tarfile
import tomllib
import zipfile
from pathlib import Path
from typing import IO

from shared.errors import UserError
from shared.installed import DISTRIBUTION
from shared.rig import RigConfig
from station.app.deploy.systems import DEPLOY

PACKAGES = ("pi_agent", "shared")
KEYS = ("ca.pem", "cert.pem", "key.pem")
RIGHTS = "rights.toml"
"""The file that says which keys count as which process's: `station keys new` writes it, other makers of keys do not."""
UNIT = "pi-agent.service"


@dataclasses.dataclass(frozen=True)
class Release:
    """The files of a release by their path in it."""

    id: str
    files: dict[str, bytes]


def checkout() -> Path:
    """Returns the folder that holds pi_agent, shared and deploy.

    Raises:
        UserError: if this is not a checkout.
    """
    if not (DEPLOY / UNIT).is_file():
        raise UserError(f"Expected the folder deploy/ of a checkout at {DEPLOY}, got none: run this from a checkout")
    return DEPLOY.parent


def build_release(rig: RigConfig, *, folder: Path, code: Path, keys: Path | None, root: str) -> Release:
    """Builds the release for a rig whose file lies in `folder`.

    Raises:
        UserError: if a part is missing.
    """
    files = {**_code_files(code), "rig.toml": rig.text.encode(), UNIT: unit_text(root).encode()}
    files |= _companions(rig, folder)
    files |= {f"keys/{name}": _read(keys / name) for name in _names_of_keys(keys)} if keys else {}
    files["deploy.pyz"] = tool_archive()
    version = _version(code)
    content = hashlib.sha256()
    for name in sorted(files):
        content.update(f"{name}\0{len(files[name])}\0".encode() + files[name])
    own = f"{version}-{content.hexdigest()[:12]}"
    about = {"id": own, "revision": _revision(code), "rig": rig.id}
    files["release.json"] = (json.dumps(about, indent=1) + "\n").encode()
    metadata = f"Metadata-Version: 2.1\nName: {DISTRIBUTION}\nVersion: {own.replace('-', '+')}\n"
    files[f"{DISTRIBUTION.replace('-', '_')}-{version}.dist-info/METADATA"] = metadata.encode()
    return Release(own, files)


def unit_text(root: str = "/") -> str:
    """Returns the systemd unit, for an installation below `root`."""
    prefix = root.rstrip("/")
    text = (DEPLOY / UNIT).read_text(encoding="utf-8")
    return text.replace("/opt/repose", f"{prefix}/opt/repose") if prefix else text


def tool_archive() -> bytes:
    """Returns the part that runs on the target, as a zip archive that Python runs; the same bytes every time."""
    folder = Path(__file__).parent / "target"
    members = {"__main__.py": "import sys\nfrom target.main import main\nsys.exit(main(sys.argv[1:]))\n"}
    members |= {f"target/{path.name}": path.read_text(encoding="utf-8") for path in sorted(folder.glob("*.py"))}
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, text in members.items():
            archive.writestr(zipfile.ZipInfo(name), text)
    return buffer.getvalue()


def send(release: Release, site: Path | None, sink: IO[bytes]) -> None:
    """Writes release and, if given, the unpacked wheels as one tar stream."""
    with (
        gzip.GzipFile(fileobj=sink, mode="wb", compresslevel=1) as packed,
        tarfile.open(fileobj=packed, mode="w|") as archive,
    ):
        for name, content in release.files.items():
            member = tarfile.TarInfo(f"release/{name}")
            member.size, member.mode = len(content), 0o600 if name.startswith("keys/") else 0o644
            archive.addfile(member, io.BytesIO(content))
        if site is not None:
            archive.add(site, "site")


def _names_of_keys(keys: Path) -> tuple[str, ...]:
    return (*KEYS, RIGHTS) if (keys / RIGHTS).exists() else KEYS


def _code_files(code: Path) -> dict[str, bytes]:
    files: dict[str, bytes] = {}
    for package in PACKAGES:
        if not (code / package / "__init__.py").is_file():
            raise UserError(f"Expected the package {package} in {code}, got none")
        for path in sorted((code / package).rglob("*")):
            if path.is_file() and "__pycache__" not in path.parts:
                files[str(path.relative_to(code))] = path.read_bytes()
    return files


def _companions(rig: RigConfig, folder: Path) -> dict[str, bytes]:
    """Returns the files that the rig file names and that lie beside it.

    These are the calibration, and what a played camera plays.
    """
    names = [rig.camera.calibration]
    if rig.camera.driver == "video_file":
        names.append(str(rig.camera.options.values.get("path", "")))
    files: dict[str, bytes] = {}
    for name in names:
        if not name or Path(name).is_absolute():  # an absolute path is one on the Pi
            continue
        named = folder / name
        for path in [named] if named.is_file() else sorted(path for path in named.rglob("*") if path.is_file()):
            inside = (
                path.resolve().relative_to(folder.resolve())
                if path.resolve().is_relative_to(folder.resolve())
                else None
            )
            if inside is None:
                raise UserError(f"Expected '{name}' to lie in the rig file's folder {folder}, got {path.resolve()}")
            files[str(inside)] = path.read_bytes()
        if not named.exists():
            raise UserError(f"Expected the file {named}, which the rig file names, got nothing")
    return files


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise UserError(f"Expected the key file {path}, but it cannot be read: {error.strerror}") from error


def _version(code: Path) -> str:
    try:
        project = tomllib.loads((code / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    except (OSError, KeyError, tomllib.TOMLDecodeError):
        return "0"
    return str(project["version"])


def _revision(code: Path) -> str:
    words = ["git", "-C", str(code), "describe", "--always", "--dirty"]
    try:
        return subprocess.run(words, capture_output=True, text=True, check=False).stdout.strip()
    except OSError:
        return ""
