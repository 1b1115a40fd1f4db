"""A simulated rig of real processes, each on its own cable where that is possible, with listeners beside them."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from station.app.assembly import rig_from
from tests.faults.network import Network
from tests.system.live_rig import FAST
from tests.system.processes import ROOT, rig_file

PROCESSES = {
    "twin": ("station", "twin"),
    "arm": ("station", "arm"),
    "camera": ("pi_agent", "run"),
}
"""The processes in the order in which they are started."""
EARS = {
    "camera": ("camera/corners",),
    "arm": ("arm/platform",),
    "station": ("session/event", "session/sample", "log"),
}
"""Beside which process an independent listener hears what."""


class FailedError(Exception):
    """The rig did not do what a trial needs before its fault begins."""


@dataclass
class Lab:
    """Processes by name, the files of their listeners, and what is sabotaged."""

    folder: Path
    network: Network | None
    rig: Path = field(default_factory=Path)
    processes: dict[str, subprocess.Popen[bytes]] = field(default_factory=dict[str, subprocess.Popen[bytes]])
    session_path: Path = field(default_factory=Path)
    trial: int = 0

    @property
    def disk(self) -> Path:
        """The folder that the sessions record to."""
        return self.folder / "disk"

    def mount(self, megabytes: int, *, ext4: bool = False) -> None:
        """A disk of its own for the recordings, in memory or as a file with ext4; it needs root.

        With ext4 the kernel is told to hold nothing back (`sync`): what a program has written is on the disk.
        """
        self.unmount()
        self.disk.mkdir(exist_ok=True)
        if not ext4:
            subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={megabytes}m", "tmpfs", str(self.disk)], check=True)
            return
        with self._image.open("wb") as file:
            file.truncate(megabytes * 1_000_000)
        subprocess.run(["mkfs.ext4", "-q", "-F", str(self._image)], check=True)
        self._mount_ext4(self._image)

    @property
    def _image(self) -> Path:
        return self.folder / "disk.img"

    def mend(self) -> None:
        """Checks the disk with ext4 and mounts what it holds anew.

        It is a copy, since the processes of the rig still have the disk as it was (`ip netns exec` gives each mounts of
        its own).
        """
        self.unmount()
        mended = shutil.copyfile(self._image, self.folder / "mended.img")
        # It exits with 1 when it has mended something.
        subprocess.run(["e2fsck", "-f", "-y", str(mended)], check=False, capture_output=True, timeout=60)
        self._mount_ext4(mended)

    def _mount_ext4(self, image: Path) -> None:
        how = "loop,sync,errors=remount-ro"
        subprocess.run(["mount", "-t", "ext4", "-o", how, str(image), str(self.disk)], check=True)

    def unmount(self) -> None:
        """Takes the disk away again, if it was one."""
        if self.disk.is_mount():
            subprocess.run(["umount", str(self.disk)], check=True)

    def sweep(self) -> None:
        """Removes the recordings of a trial."""
        for path in self.disk.glob("session*"):
            path.unlink()

    def make(self) -> None:
        """Writes the rig file."""
        self.disk.mkdir(exist_ok=True)
        self.rig = rig_file(self.folder, name="faults")
        if self.network is not None:
            text = self.rig.read_text(encoding="utf-8")
            for name in ("camera", "arm", "twin", "station"):
                text = text.replace(f'{name} = "tcp/127.0.0.1:', f'{name} = "tcp/{self.network.address(name)}:')
            self.rig.write_text(text.replace("[bus]", "[bus]\ninsecure = true"), encoding="utf-8")

    def start(self, name: str, *words: str) -> None:
        """Starts camera, arm or twin; each can be sabotaged."""
        module, *others = PROCESSES[name]
        self._start(
            name, name, "tests.faults.sabotaged", str(self.control(name)), module, *others, *self._rig(), *words
        )

    def session(self, *, samples: int = 500, faults: int = 50) -> Path:
        """Starts a session that goes on until it is stopped."""
        plan = self.folder / "plan.toml"
        plan.write_text(FAST.format(samples=samples, faults=faults, outage_s=0.0), encoding="utf-8")
        self.trial += 1
        self.session_path = self.disk / f"session{self.trial}.mcap"
        self._start(
            "station", "station", "station", "run", *self._rig(), "--plan", str(plan), "--out", str(self.session_path)
        )
        return self.session_path

    def _rig(self) -> tuple[str, ...]:
        return ("--rig", str(self.rig))

    def _start(self, name: str, where: str, *words: str) -> None:
        inside = self.network.inside(where) if self.network is not None else []
        with (self.folder / f"{name}.log").open("ab") as log:
            self.processes[name] = subprocess.Popen(
                [*inside, sys.executable, "-m", *words], cwd=ROOT, stdout=log, stderr=subprocess.STDOUT
            )

    def listen(self) -> None:
        """Starts the listeners, anew for each trial."""
        bus = rig_from(str(self.rig)).bus
        for name, topics in EARS.items():
            self.end(f"ear of {name}")
            self.heard_file(name).unlink(missing_ok=True)
            at = bus.endpoint(name)[0]
            words = ("tests.faults.ear", str(self.rig), at, str(self.heard_file(name)), *topics)
            self._start(f"ear of {name}", name, *words)

    def heard_file(self, name: str) -> Path:
        """Returns the file that the listener beside a process writes."""
        return self.folder / f"heard.{name}.jsonl"

    def heard(self, name: str, topic: str = "") -> Iterator[dict[str, Any]]:
        """Yields what the listener beside a process has heard so far."""
        file = self.heard_file(name)
        for line in file.read_text(encoding="utf-8").splitlines() if file.exists() else ():
            with contextlib.suppress(ValueError):  # the last line may be half written
                told = json.loads(line)
                if topic in ("", told["topic"]):
                    yield told

    def control(self, name: str) -> Path:
        """The file that says what is broken in a process."""
        return self.folder / f"control.{name}.json"

    def sabotage(self, name: str, **what: Any) -> None:
        """Breaks something in a process; nothing, if nothing is named."""
        self.control(name).write_text(json.dumps(what), encoding="utf-8")

    def revive(self) -> None:
        """Starts what does not run; all of it if the twin does not, where the arm stands."""
        if not self.runs("twin"):
            for name in PROCESSES:
                self.end(name)
        for name in PROCESSES:
            self.sabotage(name)
            if not self.runs(name):
                self.start(name)

    def runs(self, name: str) -> bool:
        """True if a process runs."""
        return name in self.processes and self.processes[name].poll() is None

    def kill(self, name: str) -> None:
        """SIGKILL, to that very process."""
        process = self.processes.pop(name)
        process.kill()
        process.wait()

    def signal(self, name: str, number: signal.Signals) -> None:
        """A signal to that very process."""
        os.kill(self.processes[name].pid, number)

    def end(self, name: str, *, within_s: float = 30.0) -> int | None:
        """Asks a process to end; its exit status, or None if it had to be killed or did not run."""
        process = self.processes.pop(name, None)
        if process is None:
            return None
        process.send_signal(signal.SIGCONT)
        process.send_signal(signal.SIGINT if name == "station" else signal.SIGTERM)
        try:
            return process.wait(within_s)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            return None

    def wait(self, happened: Callable[[], bool], *, within_s: float) -> float | None:
        """Seconds until it is so; None if it is not in time."""
        begin = time.monotonic()
        while time.monotonic() - begin < within_s:
            if happened():
                return time.monotonic() - begin
            time.sleep(0.1)
        return None

    def tilting(self, since_ns: int) -> bool:
        """True if a run has begun to tilt since then."""
        return any(one["phase"] == "TILT" and one["t"] > since_ns for one in self.heard("station", "session/event"))

    def close(self) -> None:
        """Ends everything."""
        for name in ("station", *(f"ear of {name}" for name in EARS), *PROCESSES):
            self.end(name, within_s=10.0)
