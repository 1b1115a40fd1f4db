"""A target to deploy to without a Pi: a real sshd on loopback, with its own keys, and a folder that stands for "/"."""

from __future__ import annotations

import base64
import contextlib
import hashlib
import importlib.metadata
import os
import shutil
import subprocess
import sys
import time
import zipfile
from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.patience import PATIENCE_S
from tests.system.ports import free_port

DISTRIBUTIONS = ("eclipse-zenoh", "numpy", "opencv-python-headless", "protobuf")
_FAKES = Path(__file__).parent / "fake_systemd"


def absent(reason: str) -> None:
    """Skips, or fails when the deployment's tests were asked for by name (REPOSE_REQUIRE=deploy)."""
    if "deploy" in os.environ.get("REPOSE_REQUIRE", "").split(","):
        pytest.fail(reason)
    pytest.skip(reason)


@dataclass(frozen=True)
class Target:
    """The sshd; `bin` is a folder that comes first in the PATH of whoever logs in."""

    port: int
    folder: Path
    bin: Path

    @property
    def words(self) -> list[str]:
        """The options of `station deploy` that lead here."""
        options = ("StrictHostKeyChecking=yes", f"UserKnownHostsFile={self.folder}/known_hosts", "BatchMode=yes")
        return [
            *("127.0.0.1", "--port", str(self.port), "--identity", str(self.folder / "id")),
            *(word for option in options for word in ("--ssh-option", option)),
        ]


@contextlib.contextmanager
def loopback_sshd(folder: Path) -> Generator[Target]:
    """Runs an sshd of its own; skips with the reason where that is not possible."""
    sshd = shutil.which("sshd", path=os.environ.get("PATH", "") + ":/usr/sbin:/usr/local/sbin")
    if sshd is None or shutil.which("ssh") is None:
        absent("no OpenSSH here: apt-get install openssh-server")
        return
    target = Target(free_port(), folder, folder / "bin")
    target.bin.mkdir()
    config = _write_configuration(target)
    if os.geteuid() == 0:
        Path("/run/sshd").mkdir(mode=0o755, exist_ok=True)  # where a root sshd insists on locking itself in
    with (folder / "sshd.log").open("wb") as log:
        process = subprocess.Popen([sshd, "-D", "-e", "-f", str(config)], stderr=log)
    try:
        _await_login(target, process)
        yield target
    finally:
        process.terminate()
        process.wait()


def _write_configuration(target: Target) -> Path:
    folder = target.folder
    for name in ("host", "id"):
        subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", str(folder / name)], check=True)
    (folder / "authorized_keys").write_text((folder / "id.pub").read_text())
    host = (folder / "host.pub").read_text().split()[:2]
    (folder / "known_hosts").write_text(f"[127.0.0.1]:{target.port} {' '.join(host)}\n")
    config = folder / "sshd_config"
    config.write_text(
        f"Port {target.port}\nListenAddress 127.0.0.1\nHostKey {folder}/host\nPidFile none\nStrictModes no\n"
        f"AuthorizedKeysFile {folder}/authorized_keys\nUsePAM no\nPasswordAuthentication no\n"
        f"KbdInteractiveAuthentication no\nPermitRootLogin prohibit-password\nAllowTcpForwarding local\n"
        f"SetEnv PATH={target.bin}:/usr/local/bin:/usr/bin:/bin\n"
    )
    return config


def _await_login(target: Target, process: subprocess.Popen[bytes]) -> None:
    words = ["ssh", "-p", str(target.port), "-i", str(target.folder / "id"), "-o", "BatchMode=yes"]
    words += ["-o", f"UserKnownHostsFile={target.folder}/known_hosts", "127.0.0.1", "true"]
    give_up = time.monotonic() + PATIENCE_S
    while subprocess.run(words, capture_output=True, check=False).returncode != 0:
        if process.poll() is not None or time.monotonic() > give_up:
            process.terminate()
            absent(f"no login through an own sshd here: {(target.folder / 'sshd.log').read_text()[-300:]}")
        time.sleep(0.1)


def install_fake_systemd(target: Target, root: Path) -> None:
    """Puts a `systemctl` and a `journalctl` before the target's own; they run the unit below `root`."""
    for name in ("systemctl", "journalctl"):
        script = target.bin / name
        script.write_text(f'#!/bin/sh\nexec {sys.executable} {_FAKES}.py {root} {name} "$@"\n')
        script.chmod(0o755)


def repack_wheels(folder: Path) -> Path:
    """Makes wheels of the libraries installed here, and their lock; gives the lock's path.

    The real locks pin aarch64 wheels, which this machine cannot run.
    """
    folder.mkdir()
    lines: list[str] = []
    for name in DISTRIBUTIONS:
        distribution = importlib.metadata.distribution(name)
        wheel = folder / f"{name.replace('-', '_')}-{distribution.version}-py3-none-any.whl"
        with zipfile.ZipFile(wheel, "w") as archive:
            for file in distribution.files or ():
                place = Path(str(distribution.locate_file(file)))
                needed = not {"..", "tests", "f2py"} & set(file.parts) and place.suffix not in {".pyc", ".pyi"}
                if needed and place.is_file():
                    archive.write(place, str(file))
        digest = hashlib.sha256(wheel.read_bytes()).hexdigest()
        lines.append(f"{name}=={distribution.version} \\\n    --hash=sha256:{digest}\n")
    lock = folder / "test.lock"
    lock.write_text("".join(lines))
    return lock


def secret() -> str:
    """A text that no other file holds."""
    return base64.b64encode(os.urandom(24)).decode()
