"""A rig of real processes that tests kill, freeze out and starve, and an ear on its bus."""

from __future__ import annotations

import contextlib
import subprocess
import time
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from shared.bus import Received
from shared.messages import (
    Message,
    PlatformState,
    RunEvent,
    Sample,
)
from shared.zenoh_bus import ZenohBus
from station.__main__ import main
from station.app import assembly
from station.recording.reader import RecordingReader
from tests.patience import PATIENCE_S
from tests.system.ports import free_port
from tests.system.processes import CALM_HZ, end, rig_file, start

HELPERS = {"camera": ("pi_agent", "run"), "arm": ("station", "arm"), "twin": ("station", "twin")}
FAST = """\
samples = {samples}
faults = {faults}
outage_s = {outage_s}
[tilt]
steps = 20
rate_deg_s = 10.0
adapt_after = 0
"""


@dataclass
class Rig:
    """The processes of one rig, an ear on its bus, and what the sessions on it printed."""

    folder: Path
    file: Path
    bus: ZenohBus
    processes: dict[str, subprocess.Popen[str]] = field(default_factory=dict[str, subprocess.Popen[str]])
    heard: dict[str, list[Received]] = field(default_factory=dict[str, list[Received]])

    def start(self, name: str) -> None:
        """Starts a helper: camera, arm or twin."""
        self.processes[name] = start(*HELPERS[name], "--rig", str(self.file))

    def revive(self) -> None:
        """Starts every helper that a test before has killed; all of them if it was the twin, where the arm stands."""
        if "twin" not in self.processes:
            for name in list(self.processes):
                end(self.processes.pop(name))
        for name in HELPERS:
            if name not in self.processes:
                self.start(name)
            assert self.processes[name].poll() is None, f"{name} has ended by itself"
        self.wait("all helpers", lambda: self.bus.alive() >= set(HELPERS), running="")

    def session(
        self,
        out: str,
        *more: str,
        samples: int = 50,
        faults: int = 5,
        outage_s: float = 0.0,
        dwell_s: float = 0.5,
        name: str = "run",
        file: Path | None = None,
    ) -> Path:
        """Starts a session that records to `out`; its process is `name`."""
        plan, path = self.folder / f"{out}.toml", self.folder / out
        text = FAST.format(samples=samples, faults=faults, outage_s=outage_s)
        plan.write_text(f"{text}[dwell]\nmin_s = {dwell_s}\nmax_s = {dwell_s}\n", encoding="utf-8")
        words = ("run", "--rig", str(file or self.file), "--plan", str(plan), "--out", str(path))
        self.processes[name] = start("station", *words, *more)
        return path

    def second_file(self) -> Path:
        """The same rig for a second station, which listens elsewhere."""
        text, file = self.file.read_text(encoding="utf-8"), self.folder / "second.toml"
        mine = assembly.rig_from(str(self.file)).bus.station
        file.write_text(text.replace(mine, f"tcp/127.0.0.1:{free_port()}"), encoding="utf-8")
        return file

    def kill(self, name: str) -> None:
        """SIGKILL, to that very process."""
        process = self.processes.pop(name)
        process.kill()
        process.communicate(timeout=PATIENCE_S)

    def listen(self, topic: str) -> list[Received]:
        """Everything that comes on a topic from now on."""
        if topic not in self.heard:
            self.heard[topic] = []
            self.bus.subscribe(topic, self.heard[topic].append)
        return self.heard[topic]

    def messages(self, topic: str, *, since_ns: int = 0) -> list[Message]:
        return [item.message for item in self.listen(topic) if item.receive_ns >= since_ns]

    def wait(self, what: str, condition: Callable[[], bool], *, running: str = "run") -> None:
        """Listens until it is so; fails in words when it is not in time, or when the session has ended before."""
        limit = time.monotonic() + PATIENCE_S
        while not condition():
            self.bus.poll(0.05)
            process = self.processes.get(running) if running else None
            if process is not None and process.poll() is not None and not condition():
                pytest.fail(f"the session ended before {what}: {process.communicate()[0]}")
            if time.monotonic() > limit:
                pytest.fail(f"waited {PATIENCE_S:g} s in vain for: {what}; phases {self.phases()[-12:]}")

    def phases(self) -> list[tuple[int, str]]:
        """Run and phase of every event heard."""
        events = [message for message in self.messages("session/event") if isinstance(message, RunEvent)]
        return [(event.run, event.phase) for event in events if not event.phase.startswith("STEP")]

    def aborted(self) -> bool:
        """True if a run was given up."""
        return any(phase == "ABORTED" for _, phase in self.phases())

    def tilt_rad(self) -> float:
        """The plate's tilt as last heard."""
        return tilt_of(self.listen("arm/platform")[-1].message)

    def tilting(self, *, above_rad: float = 0.1) -> bool:
        """True if a run is tilting the plate, by more than that."""
        phases = self.phases()
        attitudes = self.listen("arm/platform")
        return bool(phases and attitudes) and phases[-1][1] == "TILT" and self.tilt_rad() > above_rad

    def ended(self, name: str = "run") -> tuple[int, str]:
        """Waits for a session's own end; its status and what it printed."""
        process = self.processes.pop(name)
        try:
            printed = process.communicate(timeout=PATIENCE_S)[0]
        except subprocess.TimeoutExpired:
            process.kill()
            pytest.fail(f"{name} did not end within {PATIENCE_S:g} s: {process.communicate()[0]}")
        return process.returncode, printed


def tilt_of(message: Message) -> float:
    """Angle between the plate's normal and the vertical."""
    assert isinstance(message, PlatformState)
    return 2 * float((message.qx**2 + message.qy**2) ** 0.5)


def events_of(reader: RecordingReader) -> list[RunEvent]:
    return [item.message for item in reader.messages({"session/event"}) if isinstance(item.message, RunEvent)]


def samples_of(reader: RecordingReader) -> list[Sample]:
    """Returns the samples that count: on a busy machine a frame may be late and disturb a run, which is done again."""
    return [sample for sample in reader.samples() if not sample.disturbed]


def decided_the_same(path: Path) -> bool:
    """The replay law holds for a session with faults as well."""
    return main(["check", str(path)]) == 0


@pytest.fixture(scope="module")
def one_rig(tmp_path_factory: pytest.TempPathFactory) -> Generator[Rig]:
    folder = tmp_path_factory.mktemp("faults")
    file = rig_file(folder, rate_hz=CALM_HZ)
    config = assembly.rig_from(str(file))
    with contextlib.ExitStack() as stack:
        bus = stack.enter_context(ZenohBus(config.id, connect=config.bus.peers("observer")))
        made = Rig(folder=folder, file=file, bus=bus)
        stack.callback(lambda: [end(process) for process in reversed(made.processes.values())])
        for topic in ("session/event", "session/sample", "arm/platform", "arm/motion", "log"):
            made.listen(topic)
        yield made


@pytest.fixture
def rig(one_rig: Rig, tmp_path: Path) -> Generator[Rig]:
    """The module's rig, with every helper alive, no session, and nothing heard yet."""
    one_rig.revive()
    one_rig.bus.poll(0.5)  # messages still come from the session before
    for heard in one_rig.heard.values():
        heard.clear()
    one_rig.folder = tmp_path
    yield one_rig
    if "run" in one_rig.processes:
        end(one_rig.processes.pop("run"))
