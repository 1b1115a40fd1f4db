"""A simulated session, recording included, runs faster than life: prints the factor and where the time goes.

`pytest -m benchmark tests/benchmarks/test_lockstep_speed.py -s`; LOCKSTEP_SAMPLES sets the length of a session.
Seconds are those of the processor, and the best of several sessions counts, because other programs only ever add.
A busy machine makes every second of the processor longer, too: the line about the yardstick says by how much a fixed
piece of work took longer during the session than at its best. The session that counts is run as `station run
--lockstep` runs it: another process writes the file where there is a second processor, whose seconds stand beside.
The last two run the command itself, its start included, and print the seconds of the clock as well.
"""

from __future__ import annotations

import os
import resource
import struct
import subprocess
import sys
import time
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from shared.clock import SIMULATION_EPOCH_NS
from shared.messages import MarkerCorners
from station.app import assembly, recordings
from station.app.lockstep import CameraBuilder, Lockstep
from station.app.pixels import pixel_camera
from station.recording.reader import open_recording
from station.recording.recorder import Sink
from station.recording.writer import Recording
from station.recording.writer_process import WriterProcess, can_start_writer_process

pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(900)]

SAMPLES = int(os.environ.get("LOCKSTEP_SAMPLES", "10"))
PIXEL_SECONDS = 6.0
REPEATS = 3
PROMISED, PROMISED_WITH_PIXELS = 100.0, 2.0
_YARDSTICK_NS = 500_000_000


@dataclass(frozen=True, slots=True)
class Timing:
    """One session: its own seconds, the processor's without the yardstick, and the yardstick's mean and best.

    `writer_s` are the seconds of the process that wrote the file, on another processor; `wall_s` those of the clock,
    with the yardstick.
    """

    simulated_s: float
    cpu_s: float
    writer_s: float
    wall_s: float
    yardstick_s: float
    best_s: float

    @property
    def factor(self) -> float:
        """Times faster than life, as measured."""
        return self.simulated_s / self.cpu_s

    @property
    def slowed(self) -> float:
        """The factor by which everything took longer than on a quiet machine."""
        return self.yardstick_s / self.best_s


def yardstick() -> float:
    """Seconds of a fixed piece of work of the kind that a session does: messages, numbers, small arrays, packing."""
    begin, matrix, packer = time.process_time(), np.eye(4), struct.Struct("<Qddd")
    for number in range(100):
        message = MarkerCorners(number, number, tuple(0.5 * value for value in range(8)), found=True)
        moved = [1.5 * pixel + number for pixel in message.corners_px]
        packer.pack(number, *moved[:3])
        (matrix.dot(matrix) + 1.0).tolist()
    return time.process_time() - begin


def timed(path: Path, *, seed: int = 1, split: dict[str, float] | None = None, **limits: Any) -> Timing:
    """Runs and records one session, with the yardstick every half second of it."""
    recording = opened(path, seed=seed)
    sink = recording if split is not None or not can_start_writer_process() else WriterProcess(recording)
    lockstep = build(sink, seed=seed, camera=limits.pop("camera", None))
    if split is not None:
        watch(lockstep, recording, split)
    measured: list[float] = []
    best_s = min(yardstick() for _ in range(200))
    aside = 0.0
    tick, due_ns = lockstep.session.tick, SIMULATION_EPOCH_NS

    def tick_and_measure(now_ns: int) -> None:
        nonlocal aside, due_ns
        if now_ns >= due_ns:
            due_ns = now_ns + _YARDSTICK_NS
            begin = time.process_time()
            measured.append(yardstick())
            aside += time.process_time() - begin
        tick(now_ns)

    lockstep.session.tick = tick_and_measure  # type: ignore[method-assign]
    begin, wall, writer = time.process_time(), time.perf_counter(), of_children()
    outcome = lockstep.run(**limits)
    sink.close()
    cpu_s, wall_s = time.process_time() - begin - aside, time.perf_counter() - wall
    assert not outcome.fault
    assert recording.path.exists()
    writer_s = of_children() - writer
    return Timing(outcome.simulated_s, cpu_s, writer_s, wall_s, float(np.mean(measured)), min(best_s, *measured))


def of_children() -> float:
    """Seconds of the processor that finished children have taken."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def opened(path: Path, *, seed: int) -> Recording:
    rig, plan = assembly.rig_from(None), assembly.plan_from(None, samples=SAMPLES, seed=seed)
    origin = recordings.provenance(rig, plan, mode="lockstep", started_ns=SIMULATION_EPOCH_NS)
    return Recording(path, provenance=origin, overwrite=True, flush_every_s=10.0)


def build(sink: Sink, *, seed: int, camera: CameraBuilder | None) -> Lockstep:
    rig, plan = assembly.rig_from(None), assembly.plan_from(None, samples=SAMPLES, seed=seed)
    return Lockstep(rig, plan, recording=sink, camera=camera)


def watch(lockstep: Lockstep, recording: Recording, split: dict[str, float]) -> None:
    """Adds up what each part takes; one part's seconds hold those of the parts that it calls."""

    def wrap(owner: Any, name: str, label: str) -> None:
        call = getattr(owner, name)

        def timed_call(*args: Any, **options: Any) -> Any:
            begin = time.perf_counter()
            try:
                return call(*args, **options)
            finally:
                split[label] += time.perf_counter() - begin

        setattr(owner, name, timed_call)

    wrap(lockstep, "_tick_arm", "twin and arm")
    wrap(lockstep.twin.world, "advance", "physics (in twin and camera)")
    wrap(lockstep, "_tick_camera", "camera")
    wrap(lockstep, "_tick_session", "heartbeat and transforms")
    wrap(lockstep.session.machine, "handle", "state machine (in all of them)")
    wrap(recording, "_add", "recording (in all of them)")


def report(name: str, timings: list[Timing], *, promised: float) -> Timing:
    """Prints the best of several sessions."""
    best = max(timings, key=lambda timing: timing.factor * timing.slowed)
    quiet = best.factor * best.slowed
    print(
        f"\n{name}: {best.factor:.1f} times faster than life ({best.simulated_s:.0f} s in {best.cpu_s:.2f} s of the "
        f"processor, {best.wall_s:.2f} s of the clock; {best.writer_s:.2f} s of another one for the file); by the "
        f"yardstick ({best.slowed:.2f} times slower than at its best) {quiet:.1f} on a quiet machine; promised "
        f"{promised:g}"
    )
    return best


def test_a_session_without_pixels(tmp_path: Path) -> None:
    timings = [timed(tmp_path / "session.mcap") for _ in range(REPEATS)]
    best = report("without pixels", timings, promised=PROMISED)
    split: defaultdict[str, float] = defaultdict(float)
    seen = timed(tmp_path / "split.mcap", split=split)
    print("per second of the session (with the stop-watch's own cost):")
    for part, seconds in sorted(split.items(), key=lambda item: -item[1]):
        print(f"  {part:32s} {1e3 * seconds / seen.simulated_s:7.2f} ms")
    size = (tmp_path / "session.mcap").stat().st_size
    print(f"  {size / best.simulated_s / 1e3:.1f} kB recorded")
    assert best.factor > 0.1 * PROMISED


def test_a_session_with_pixels(tmp_path: Path) -> None:
    timings = [timed(tmp_path / "pixels.mcap", camera=pixel_camera(1), limit_s=PIXEL_SECONDS) for _ in range(REPEATS)]
    best = report("with pixels", timings, promised=PROMISED_WITH_PIXELS)
    assert best.factor > 0.1 * PROMISED_WITH_PIXELS


@pytest.mark.parametrize(
    ("pixels", "samples", "promised"),
    [((), SAMPLES, PROMISED), (("--pixels",), 1, PROMISED_WITH_PIXELS)],
    ids=["without pixels", "with pixels"],
)
def test_the_whole_command(pixels: tuple[str, ...], samples: int, promised: float, tmp_path: Path) -> None:
    path = tmp_path / "command.mcap"
    words = ["run", "--lockstep", "--samples", str(samples), "--seed", "1", "--out", str(path), "--overwrite", *pixels]
    spent: list[tuple[float, float]] = []
    for _ in range(1 if pixels else REPEATS):
        begin, cpu = time.perf_counter(), of_children()
        subprocess.run([sys.executable, "-m", "station", *words], check=True, capture_output=True)
        spent.append((time.perf_counter() - begin, of_children() - cpu))
    wall_s, cpu_s = (min(seconds) for seconds in zip(*spent, strict=True))
    simulated_s = open_recording(path).duration_s
    print(
        f"\nstation {' '.join(words)}:\n  {simulated_s / wall_s:.1f} times faster than life by the clock, start "
        f"included ({simulated_s:.0f} s in {wall_s:.2f} s; {cpu_s:.2f} s of the processors, both processes together); "
        f"promised {promised:g}"
    )
    assert simulated_s > 0.1 * promised * cpu_s
