"""Stands in for systemctl and journalctl: runs one unit's ExecStart, as systemd would, less the sandbox.

Called as: fake_systemd.py ROOT systemctl|journalctl WORDS… . It refuses what systemd would refuse: a unit that it was
not told of by daemon-reload, or that changed since.
"""

from __future__ import annotations

import contextlib
import os
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path


class FakeSystemd:
    def __init__(self, root: Path) -> None:
        self.unit = root / "etc/systemd/system/pi-agent.service"
        self.state = root / "run/fake-systemd"
        self.state.mkdir(parents=True, exist_ok=True)
        self.loaded, self.pid_file = self.state / "loaded.service", self.state / "pid"
        self.enabled, self.journal = self.state / "enabled", self.state / "journal"
        self.calls = self.state / "calls"

    def systemctl(self, words: list[str]) -> int:
        with self.calls.open("a") as calls:
            calls.write(" ".join(words) + "\n")
        verb, *rest = [word for word in words if word not in {"--quiet", "--now"}]
        if verb == "daemon-reload":
            self.loaded.write_text(self.unit.read_text()) if self.unit.exists() else self.loaded.unlink(missing_ok=True)
        elif verb == "show":
            pid = self.running()
            print(f"ActiveState={'active' if pid else 'failed'}\nMainPID={pid}")
        elif verb in {"enable", "restart"} and self.stale():
            print(f"Unit {rest[-1]}.service not found or changed on disk", file=sys.stderr)
            return 5
        elif verb == "enable":
            self.enabled.touch()
        elif verb == "disable":
            self.enabled.unlink(missing_ok=True)
            if "--now" in words:
                self.stop()
        elif verb == "stop":
            self.stop()
        elif verb == "restart":
            self.stop()
            self.start()
        return 0

    def stale(self) -> bool:
        return not self.unit.exists() or not self.loaded.exists() or self.loaded.read_text() != self.unit.read_text()

    def start(self) -> None:
        settings: dict[str, list[str]] = {}
        for line in self.loaded.read_text().splitlines():
            key, equals, value = line.partition("=")
            if equals and not line.startswith("#"):
                settings.setdefault(key, []).append(value)
        environment = {"PATH": os.environ["PATH"]}
        for line in settings["Environment"]:
            environment |= dict(word.split("=", 1) for word in shlex.split(line))
        with self.journal.open("ab") as journal:
            process = subprocess.Popen(
                shlex.split(settings["ExecStart"][0]),
                cwd=settings["WorkingDirectory"][0],
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=journal,
                stderr=journal,
                start_new_session=True,
            )
        self.pid_file.write_text(str(process.pid))

    def running(self) -> int:
        with contextlib.suppress(OSError, ValueError):
            pid = int(self.pid_file.read_text())
            if Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z":
                return pid
        return 0

    def stop(self) -> None:
        pid = self.running()
        if pid:
            os.kill(pid, signal.SIGTERM)
            for _ in range(200):
                if not self.running():
                    return
                time.sleep(0.05)
            os.kill(pid, signal.SIGKILL)


def main() -> int:
    systemd = FakeSystemd(Path(sys.argv[1]))
    if sys.argv[2] == "journalctl":
        print("\n".join(systemd.journal.read_text().splitlines()[-12:]) if systemd.journal.exists() else "")
        return 0
    return systemd.systemctl(sys.argv[3:])


if __name__ == "__main__":
    sys.exit(main())
