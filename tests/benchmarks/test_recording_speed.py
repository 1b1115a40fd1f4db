"""Recordings are written and read: prints a table, and holds it to the figures that are promised.

`pytest -m benchmark tests/benchmarks/test_recording_speed.py -s`; RECORDING_SECONDS sets the simulated time.
Every figure is the smallest of several repeats, because other programs only ever add.
"""

from __future__ import annotations

import io
import os
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import CompressionType, Writer

from shared import wire
from shared.clock import SIMULATION_EPOCH_NS, SimulatedClock
from shared.fields import slots
from shared.memory_bus import MemoryBus
from shared.messages import Heartbeat, JointState, MarkerCorners, Message, PlatformState
from station.recording.arrays import load_signals
from station.recording.mcap_file import McapFile
from station.recording.provenance import Provenance
from station.recording.reader import open_recording
from station.recording.recorder import record_within
from station.recording.writer import Recording
from tests.unit.recording.by_message import signals_by_message

pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(900)]

SECONDS = int(os.environ.get("RECORDING_SECONDS", "60"))
REPEATS = 5
Traffic = list[tuple[int, str, Message]]


def traffic(seconds: int) -> Traffic:
    """Returns a session of the simulated rig, by rate: corners 90, arm 2 × 100, heartbeat and transforms 40."""
    rng = np.random.default_rng(1)
    items: Traffic = []
    for tick in range(330 * seconds):
        now_ns = SIMULATION_EPOCH_NS + tick * 1_000_000_000 // 330
        kind = tick % 33
        if kind < 9:
            pixels = tuple((300 + rng.normal(size=8)).tolist())
            corners = MarkerCorners(now_ns, tick, pixels, 0.02, 0.02, 2_000_000, (0, 0, 0, 0), True, boot_id=7)
            items.append((now_ns, "camera/corners", corners))
        elif kind < 19:
            items.append((now_ns, "arm/platform", PlatformState(now_ns, *rng.normal(size=10).tolist())))
        elif kind < 29:
            six = [tuple(rng.normal(size=6).tolist()) for _ in range(3)]
            names = ("j1", "j2", "j3", "j4", "j5", "j6")
            items.append((now_ns, "arm/joints", JointState(now_ns, names, *six)))
        else:
            items.append((now_ns, "session/heartbeat", Heartbeat(now_ns, armed=True)))
    return items


@pytest.fixture(scope="module")
def items() -> Traffic:
    return traffic(SECONDS)


def cost_us(run: Callable[[], object], count: int) -> float:
    """Microseconds of processor time a message, at best."""
    best = float("inf")
    for _ in range(REPEATS):
        start = time.process_time()
        run()
        best = min(best, time.process_time() - start)
    return best / count * 1e6


def record(path: Path, items: Traffic, *, flush_every_s: float) -> None:
    clock = SimulatedClock()
    bus = MemoryBus(clock)
    provenance = Provenance(rig_id="bench", started_ns=SIMULATION_EPOCH_NS, mode="lockstep")
    with Recording(path, provenance=provenance, overwrite=True, flush_every_s=flush_every_s) as recording:
        record_within(bus, recording)
        for now_ns, topic, message in items:
            clock.advance_to(now_ns)
            bus.publish(topic, message)


def encode(items: Traffic) -> list[bytes]:
    return [wire.encode(message) for _, _, message in items]


def test_recording_costs_no_more_than_encoding(tmp_path: Path, items: Traffic) -> None:
    path = tmp_path / "a.mcap"
    print(f"\n{len(items)} messages; µs a message, bus and encoding included")
    costs: dict[float, float] = {}
    for flush_every_s in (10.0, 0.25):
        costs[flush_every_s] = cost_us(lambda every=flush_every_s: record(path, items, flush_every_s=every), len(items))
        size = path.stat().st_size / len(items)
        print(f"  record_within, flush every {flush_every_s:5.2f} s: {costs[flush_every_s]:5.2f} µs, {size:.0f} bytes")
    encoding = cost_us(lambda: encode(items), len(items))
    print(f"  of which encoding:{encoding:23.2f} µs")
    assert costs[10.0] < 2.2 * encoding


def test_encoding_against_fields_by_name(items: Traffic) -> None:
    """Protobuf's class is filled by one call whose keywords are written out; here they are gathered by name."""

    def by_name(message: Message) -> bytes:
        made = wire._proto_class(type(message))  # pyright: ignore[reportPrivateUsage]
        return made(**{slot.name: getattr(message, slot.name) for slot in slots(type(message))}).SerializeToString()

    def all_by_name() -> list[bytes]:
        return [by_name(message) for _, _, message in items]

    assert all_by_name() == encode(items)
    ours, theirs = cost_us(lambda: encode(items), len(items)), cost_us(all_by_name, len(items))
    print(f"\nencoding, µs a message: {ours:5.2f}; with the fields gathered by name {theirs:5.2f}")
    assert ours < theirs


def test_packing_against_the_library(items: Traffic) -> None:
    payloads = encode(items)

    def ours(compression: str) -> bytes:
        stream = io.BytesIO()
        file = McapFile(stream, library="x", compression=compression)
        channel = file.register_channel("/a", schema_id=file.register_schema("a", b""))
        for number, payload in enumerate(payloads):
            file.add_message(channel, log_ns=number, publish_ns=number, sequence=number, payload=payload)
        file.finish()
        return stream.getvalue()

    def librarys(compression: CompressionType) -> bytes:
        stream = io.BytesIO()
        writer = Writer(stream, compression=compression)
        writer.start(library="x")
        channel = writer.register_channel("/a", "protobuf", writer.register_schema("a", "protobuf", b""))
        for number, payload in enumerate(payloads):
            writer.add_message(channel, number, payload, number, number)
        writer.finish()
        return stream.getvalue()

    print("\npacking alone, µs a message")
    for name, kind in (("lz4", CompressionType.LZ4), ("zstd", CompressionType.ZSTD)):
        mine = cost_us(lambda packed=name: ours(packed), len(items))
        theirs = cost_us(lambda packed=kind: librarys(packed), len(items))
        print(f"  {name:4}: ours {mine:5.2f}, mcap.writer {theirs:5.2f}, {len(ours(name)) / len(items):.0f} bytes")
        assert mine < theirs


def test_reading_is_quick_and_small(tmp_path: Path, items: Traffic) -> None:
    path = tmp_path / "a.mcap"
    record(path, items, flush_every_s=0.25)
    reader = open_recording(path)
    print("\nreading, µs a message")
    print(f"  open: {cost_us(lambda: open_recording(path), 1) / 1e3:.1f} ms")
    print(f"  payloads: {cost_us(lambda: sum(1 for _ in reader.messages()), len(items)):5.2f}")
    print(f"  decoded:  {cost_us(lambda: [item.message for item in reader.messages()], len(items)):5.2f}")
    at_once = cost_us(lambda: load_signals(reader), len(items))
    one_by_one = cost_us(lambda: signals_by_message(reader), len(items))
    print(f"  arrays:   {at_once:5.2f}, message by message {one_by_one:5.2f}: {one_by_one / at_once:.1f} times as long")
    assert at_once < one_by_one
    tracemalloc.start()
    for _ in reader.messages():
        pass
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    print(f"  memory: {peak / 1e6:.2f} MB at most, of a file of {path.stat().st_size / 1e6:.1f} MB")
    assert peak < 4e6
