"""Rig files with ports of their own, and the rig's processes started and ended by their own ids."""

from __future__ import annotations

import contextlib
import math
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Collection, Generator
from pathlib import Path

from shared.zenoh_bus import ZenohBus
from station.app.assembly import rig_from, simulated_rig_path
from station.rig.arm_settings import GateSettings
from tests.patience import PATIENCE_S
from tests.system.ports import free_port

ROOT = Path(__file__).parents[2]
LEVEL_RAD = math.radians(GateSettings().settle_tolerance_deg)
"""A recording may end as soon as the arm counts as settled: its last tilt is promised no better than that."""


CALM_HZ = 30.0
"""The camera's rate where a test looks at processes and not at frames: the rig takes .4 of a core in place of .8."""


def rig_file(folder: Path, *, name: str = "system", extra: str = "", rate_hz: float = 90.0) -> Path:
    """The simulated rig under another id, on free ports of the loopback address."""
    text = simulated_rig_path().read_text(encoding="utf-8").replace('id = "simulated"', f'id = "{name}-{free_port()}"')
    text = text.replace("rate_hz = 90.0", f"rate_hz = {rate_hz}")
    for port in ("7447", "7448", "7449", "7450"):
        text = text.replace(port, str(free_port()))
    file = folder / f"{name}.toml"
    file.write_text(text + extra, encoding="utf-8")
    return file


@contextlib.contextmanager
def observer(rig: Path) -> Generator[ZenohBus]:
    """An ear on the bus of a rig."""
    config = rig_from(str(rig))
    with ZenohBus(config.id, connect=config.bus.peers("observer")) as bus:
        yield bus


def wait(bus: ZenohBus, happened: Callable[[], bool]) -> None:
    """Listens until it is so."""
    limit = time.monotonic() + PATIENCE_S
    while not happened():
        assert time.monotonic() < limit, f"waited {PATIENCE_S:g} s in vain; alive are {sorted(bus.alive())}"
        bus.poll(0.05)


def wait_for(rig: Path, names: Collection[str]) -> None:
    """Until these processes are on the bus of the rig."""
    with observer(rig) as bus:
        wait(bus, lambda: bus.alive() >= set(names))


def start(module: str, *words: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", module, *words], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )


def end(process: subprocess.Popen[str]) -> str:
    """Asks a process to end and gives what it printed; kills it when it does not."""
    if process.poll() is None:
        process.send_signal(signal.SIGTERM)
    try:
        return process.communicate(timeout=PATIENCE_S)[0]
    except subprocess.TimeoutExpired:
        process.kill()
        return process.communicate()[0]


@contextlib.contextmanager
def running(module: str, *words: str) -> Generator[subprocess.Popen[str]]:
    process = start(module, *words)
    try:
        yield process
    finally:
        end(process)
