"""Keeps the agent running: by systemd, or by nobody (a plain process, for systems without systemd)."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import time
from pathlib import Path
from typing import Protocol

from .account import identity_of
from .paths import SERVICE, Refused, TargetPaths

GRACE_S = 12.0


class Supervisor(Protocol):
    """The tasks that the installation has for it."""

    def install(self, unit: str) -> bool:
        """Makes the unit known; True if it is another one than before."""
        ...

    def start(self) -> None:
        """Starts the current release, or starts it anew."""
        ...

    def stop(self) -> None:
        """Stops the agent; harmless when it does not run."""
        ...

    def running(self) -> int:
        """Returns the agent's process id; 0 when it does not run."""
        ...

    def log(self) -> str:
        """Returns the last lines of the agent's log."""
        ...

    def remove(self) -> None:
        """Stops the agent and makes it unknown."""
        ...


class Systemd:
    """The unit pi-agent.service."""

    def __init__(self, paths: TargetPaths) -> None:
        self._unit = paths.unit

    def install(self, unit: str) -> bool:
        """Writes the unit if it has changed, and enables it; returns true if it has."""
        changed = not self._unit.is_file() or self._unit.read_text() != unit
        if changed:
            self._unit.parent.mkdir(parents=True, exist_ok=True)
            self._unit.write_text(unit)
            _systemctl("daemon-reload")
        _systemctl("enable", "--quiet", SERVICE)
        return changed

    def start(self) -> None:
        """Restarts the unit, also after too many failures."""
        _systemctl("reset-failed", SERVICE, check=False)
        _systemctl("restart", SERVICE)

    def stop(self) -> None:
        """Stops the unit."""
        _systemctl("stop", SERVICE, check=False)

    def running(self) -> int:
        """Returns the process id of the unit, or 0; a unit that is between two restarts does not count."""
        shown = _systemctl("show", "--property=ActiveState,MainPID", SERVICE, check=False)
        values = {key: value for key, _, value in (line.partition("=") for line in shown.splitlines())}
        return int(values.get("MainPID") or 0) if values.get("ActiveState") == "active" else 0

    def log(self) -> str:
        """Returns the last twelve lines of the unit's journal; nothing without journalctl."""
        words = ["journalctl", "--unit", SERVICE, "--lines", "12", "--no-pager", "--output", "cat"]
        with contextlib.suppress(OSError):
            return subprocess.run(words, capture_output=True, text=True, check=False).stdout
        return ""

    def remove(self) -> None:
        """Disables and stops the unit, and deletes its file."""
        if self._unit.exists():
            _systemctl("disable", "--now", "--quiet", SERVICE, check=False)
            self._unit.unlink()
            _systemctl("daemon-reload")


class NoSupervisor:
    """A plain process in its own session: nobody starts it again after a fault or a reboot."""

    def __init__(self, paths: TargetPaths, *, account: str) -> None:
        self._paths, self._account = paths, account
        self._pid_file, self._log_file = paths.state / "agent.pid", paths.state / "agent.log"

    def install(self, unit: str) -> bool:
        """Returns false: there is no unit to install."""
        del unit
        return False

    def start(self) -> None:
        """Ends an agent that runs, and starts a new process with its output in the log file."""
        self.stop()
        home = self._paths.current
        words = [str(home / "venv/bin/python"), "-m", "pi_agent", "run", "--rig", str(home / "rig.toml")]
        agent = identity_of(self._account)
        settings = {"PYTHONPATH": str(home), "PYTHONUNBUFFERED": "1", "REPOSE_KEYS": str(home / "keys")}
        with self._log_file.open("wb") as log:
            process = subprocess.Popen(
                words,
                cwd=home,
                env={**os.environ, **settings},
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                start_new_session=True,
                user=agent.user,
                group=agent.group,
                extra_groups=agent.groups,
            )
        self._pid_file.write_text(str(process.pid))

    def stop(self) -> None:
        """Asks the process to end, and kills it if it is still there after the grace period."""
        pid = self.running()
        if pid:
            os.kill(pid, signal.SIGTERM)
            if not _gone(pid, GRACE_S):
                os.kill(pid, signal.SIGKILL)
                _gone(pid, GRACE_S)
        self._pid_file.unlink(missing_ok=True)

    def running(self) -> int:
        """Returns the process id from the file, or 0; it counts only while the process is an agent."""
        try:
            pid = int(self._pid_file.read_text())
        except (OSError, ValueError):
            return 0
        return pid if _is_agent(pid) else 0

    def log(self) -> str:
        """Returns the last twelve lines of the log file; nothing if it cannot be read."""
        with contextlib.suppress(OSError):
            return "\n".join(self._log_file.read_text(errors="replace").splitlines()[-12:])
        return ""

    def remove(self) -> None:
        """Stops the agent and deletes its log file."""
        self.stop()
        self._log_file.unlink(missing_ok=True)


def supervisor_of(name: str, paths: TargetPaths, *, account: str) -> Supervisor:
    """Returns the supervisor called "systemd" or "none"."""
    return Systemd(paths) if name == "systemd" else NoSupervisor(paths, account=account)


def stays_up(supervisor: Supervisor, *, seconds: float) -> bool:
    """Returns true if one and the same process runs for so long (a restart in between is a failure)."""
    first, end = supervisor.running(), time.monotonic() + seconds
    while first and time.monotonic() < end:
        time.sleep(0.25)
        if supervisor.running() != first:
            return False
    return bool(first)


def _systemctl(*words: str, check: bool = True) -> str:
    done = subprocess.run(["systemctl", *words], capture_output=True, text=True, check=False)
    if check and done.returncode != 0:
        raise Refused(f"`systemctl {' '.join(words)}` failed: {done.stderr.strip()}")
    return done.stdout


def _is_agent(pid: int) -> bool:
    try:
        words = Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0")
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return b"pi_agent" in words and state != "Z"


def _gone(pid: int, seconds: float) -> bool:
    end = time.monotonic() + seconds
    while _is_agent(pid):
        if time.monotonic() > end:
            return False
        time.sleep(0.05)
    return True
