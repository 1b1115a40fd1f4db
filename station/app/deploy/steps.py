"""The deployment, step by step, as the laptop sees it."""

from __future__ import annotations

import hashlib
import json
import shlex
import tempfile
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from shared.errors import UserError
from shared.notes import note_line
from shared.rig import RigConfig
from shared.visible import visible_in
from station.app.deploy import bundle, facts, locks, systems, verify, wheels
from station.app.deploy.facts import Facts
from station.app.deploy.remote import Remote
from station.app.deploy.systems import System


@dataclass(frozen=True, kw_only=True)
class Wishes:
    """The user's wishes; see the command's help. Empty strings mean: find it out."""

    rig_path: Path = Path("rig.toml")
    root: str = "/"
    python: str = "python3"
    supervisor: str = "auto"
    wheels: Path | None = None
    lock: Path | None = None
    code: Path | None = None
    keys: Path | None = None
    station: str = ""
    clock: bool = True
    offline: bool = False
    verify_s: float = 5.0
    patience_s: float = 20.0
    force: bool = False


def say(text: str) -> None:
    """Says one line of progress."""
    print(text, flush=True)


class Deployment:
    """One target, looked at; then installed on, rolled back, or cleaned."""

    def __init__(self, remote: Remote, wishes: Wishes) -> None:
        """Looks at the target.

        Raises:
            UserError: if there is no way to act on it with the privileges needed.
        """
        self._remote, self.wishes, self._tool_path = remote, wishes, ""
        probe = (Path(__file__).parent / "probe.sh").read_bytes()
        self.facts = facts.parse_facts(remote.run("sh", "-s", "--", wishes.root, wishes.python, given=probe))
        self._take_privileges()
        self.supervisor = wishes.supervisor
        if self.supervisor == "auto":
            self.supervisor = "systemd" if self.facts.systemd and wishes.root == "/" else "none"

    def _take_privileges(self) -> None:
        if self.facts.uid == "0" or (self.wishes.root != "/" and self.facts.writable):
            return
        if self.facts.sudo == "none":
            raise UserError(
                f"Expected to be root or to have sudo on {self._remote.target}, got neither: "
                "log in as a user who may use sudo, or install below a folder of your own with --root"
            )
        self._remote.become_root(self.facts.sudo)

    # --- other actions -----------------------------------------------------------------------------------------------

    def status(self) -> dict[str, Any]:
        """Tells what is installed."""
        return self._tool("status", "--root", self.wishes.root, "--supervisor", self.supervisor)

    def roll_back(self) -> str:
        """Goes back to the release before; returns what was done, in words."""
        done = self._tool("rollback", "--root", self.wishes.root, "--supervisor", self.supervisor)
        return str(done["did"])

    def uninstall(self, *, purge: bool) -> list[str]:
        """Removes everything; what was left on purpose."""
        words = ["uninstall", "--root", self.wishes.root, *(["--purge"] if purge else [])]
        return list(self._tool(*words)["left"])

    # --- installation ------------------------------------------------------------------------------------------------

    def install(self, rig: RigConfig) -> dict[str, Any]:
        """Checks, uploads what the target lacks, and switches; gives the target's answer.

        Raises:
            UserError: in one sentence; what ran before then runs still, or again.
        """
        system = self.check(rig)
        lock, folder = self._lock_and_folder(system)
        pins = locks.read_lock(lock)
        self._packages(rig, own_numpy=any(pin.name == "numpy" for pin in pins))
        code = self.wishes.code or bundle.checkout()
        if rig.bus.camera.startswith(("tls/", "quic/")) and self.wishes.keys is None:
            raise UserError(f"Expected --keys with the Pi's keys for the encrypted endpoint {rig.bus.camera}, got none")
        release = bundle.build_release(
            rig, folder=self.wishes.rig_path.parent, code=code, keys=self.wishes.keys, root=self.wishes.root
        )
        venv = _venv_id(self.facts, pins)
        self._upload(release, venv, lambda: self._wheels(lock, folder, system))
        say(f"Switching to release {release.id} under {self._who()}.")
        wanted = {
            "root": self.wishes.root,
            "release": release.id,
            "venv": venv,
            "python": self.wishes.python,
            "supervisor": self.supervisor,
            "station": self._station(),
            "own_numpy": any(pin.name == "numpy" for pin in pins),
        }
        return {**self._tool("install", "--wanted", json.dumps(wanted), "--root", self.wishes.root), "id": release.id}

    def check(self, rig: RigConfig) -> System | None:
        """Tells all findings; gives the target's system (None: the user brings a lock).

        Raises:
            UserError: with the first finding that stops.
        """
        foreign = self.wishes.lock is not None
        facts.require_supported(self.facts, foreign=foreign)
        system = None if foreign else systems.system_of(self.facts.codename)
        about = self.facts
        say(f"Target: {about.model or about.machine}, {about.system}, Python {about.python}, "
            f"NumPy {about.numpy or 'missing'}, {int(about.disk_free_kb or 0) // 1000} MB free.")  # fmt: skip
        ahead_s, within_s = self._remote.ahead_s()
        say(
            f"Its clock is {1e3 * ahead_s:+.0f} ± {1e3 * within_s:.0f} ms from this one; "
            f"cameras: {about.cameras or 'not listed'}."
        )
        findings = facts.findings_of(about, rig, system=system, ahead_s=ahead_s, forced=self.wishes.force)
        for finding in findings:
            say(f"Stop: {finding.sentence}" if finding.stops else note_line(finding.sentence))
        stopping = [item for item in findings if item.stops]
        if stopping:
            hint = " (--force goes on all the same)" if all(item.forceable for item in stopping) else ""
            raise UserError(stopping[0].sentence + hint)
        return system

    def _lock_and_folder(self, system: System | None) -> tuple[Path, Path]:
        if system is not None:
            return system.lock, self.wishes.wheels or wheels.wheel_folder(system)
        if self.wishes.lock is None or self.wishes.wheels is None:
            raise UserError("Expected --wheels with --lock: the folder of the wheels that the lock pins")
        return self.wishes.lock, self.wishes.wheels

    def _wheels(self, lock: Path, folder: Path, system: System | None) -> list[Path]:
        if system is None or self.wishes.offline:
            return wheels.find_wheels(lock, folder)
        return wheels.fetch(lock, folder, system)

    def _packages(self, rig: RigConfig, *, own_numpy: bool) -> None:
        """Installs Debian's packages by apt, only those that are missing."""
        have = {"python3-numpy": self.facts.numpy or own_numpy, systems.PICAMERA: self.facts.picamera2}
        missing = [name for name in systems.apt_packages(driver=rig.camera.driver) if not have[name]]
        chrony = ["chrony"] if self._clock_wanted() and not self.facts.chrony else []
        if not missing and not chrony:
            return
        if self.wishes.offline or self.wishes.root != "/":
            if missing:
                raise UserError(
                    f"Expected the Debian packages {', '.join(missing)} on the target, got none: "
                    f"sudo apt-get install {' '.join(missing)} there, or leave --offline away"
                )
            say(note_line("the target has no chrony, and none is installed offline; its clock is only measured"))
            return
        say(f"Installing Debian's {', '.join([*missing, *chrony])} on the target.")
        line = "DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "
        script = f"apt-get update -q && {line}{shlex.join([*missing, *chrony])}"
        self._remote.run("sh", "-c", script, root=True)

    def _clock_wanted(self) -> bool:
        return self.wishes.clock and self.wishes.root == "/"

    def _station(self) -> str:
        """Returns the station's address as the target sees it."""
        return (self.wishes.station or self.facts.client) if self._clock_wanted() else ""

    def _upload(self, release: bundle.Release, venv: str, wheels_of: Callable[[], list[Path]]) -> None:
        there = self.status()
        with_site = venv not in there["venvs"]
        if release.id in there["releases"] and not with_site:
            say(f"Release {release.id} is on the target already: nothing to copy.")
            return
        incoming = f"{self.wishes.root.rstrip('/')}/opt/repose/incoming"
        script = f"rm -rf {shlex.quote(incoming)} && mkdir -p {shlex.quote(incoming)} && " + (
            f"tar -xz --no-same-owner -f - -C {shlex.quote(incoming)}"
        )
        files, begin_s = wheels_of() if with_site else [], time.monotonic()
        with _unpacked(files) as site, self._remote.feed("sh", "-c", script) as sink:
            bundle.send(release, site, sink)
        what = "code and dependencies" if with_site else "code; its dependencies are there already"
        say(f"Copied release {release.id} ({what}) in {time.monotonic() - begin_s:.1f} s.")

    def _who(self) -> str:
        if self.supervisor == "systemd":
            return "systemd (pi-agent.service)"
        return "no supervisor: nobody starts it again after a fault or a reboot"

    def _tool(self, *words: str) -> dict[str, Any]:
        """Runs the part on the target; it is sent along, so that it fits this end.

        Raises:
            UserError: with its sentence.
        """
        self._tool_path = self._tool_path or self._remote.keep(bundle.tool_archive())
        said = self._remote.run(self.wishes.python, self._tool_path, *words, root=True, check=False)
        lines = [line for line in said.splitlines() if line.startswith("{")]
        if not lines:
            raise UserError(
                f"Expected an answer from the target, got: {said.strip()[-300:] or 'nothing (is sudo allowed?)'}"
            )
        answer: dict[str, Any] = visible_in(json.loads(lines[-1]))
        if "refused" in answer:
            raise UserError(str(answer["refused"]))
        return answer

    # --- verification ------------------------------------------------------------------------------------------------

    def verify(self, rig: RigConfig) -> verify.Arrival:
        """Listens for corners; through the ssh connection when the agent is bound to the target's loopback."""
        endpoint = rig.bus.camera
        protocol, _, address = endpoint.partition("/")
        host, _, port = address.partition("#")[0].rpartition(":")
        if host in {"127.0.0.1", "localhost", "[::1]"}:
            endpoint = f"{protocol}/127.0.0.1:{self._remote.tunnel(int(port))}"
            say("The agent listens on its own loopback address: listening through the ssh connection.")
        return verify.watch(rig, endpoint, seconds=self.wishes.verify_s, patience_s=self.wishes.patience_s)


@contextmanager
def _unpacked(files: list[Path]) -> Generator[Path | None]:
    with tempfile.TemporaryDirectory(prefix="repose-site-") as scratch:
        if files:
            wheels.unpack(files, Path(scratch) / "site")
        yield Path(scratch) / "site" if files else None


def _venv_id(about: Facts, pins: tuple[locks.Pin, ...]) -> str:
    """Returns the dependencies' name on the target: equal pins share a venv."""
    text = "\n".join(
        f"{pin.name}=={pin.version} {' '.join(sorted(pin.hashes))}" for pin in sorted(pins, key=lambda p: p.name)
    )
    return f"python{about.python}-{hashlib.sha256(text.encode()).hexdigest()[:12]}"
