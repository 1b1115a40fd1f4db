"""Reading many messages at once gives what reading them one by one gives, to the bit, and the same faults."""

from __future__ import annotations

import dataclasses
import math
import tracemalloc
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from google.protobuf.internal import encoder

from shared import wire
from shared.errors import UserError
from shared.messages import (
    AngleReading,
    BlockPose,
    CameraGeometry,
    Environment,
    MarkerCorners,
    Message,
    MotionReport,
    PlatformState,
    RunEvent,
    Sample,
    TiltCommand,
)
from station.recording.arrays import load_signals
from station.recording.columns import LETTERS
from station.recording.mcap_file import McapFile
from station.recording.reader import open_recording
from station.signals.session import Signals
from station.signals.tracks import Track
from tests.unit.recording import session
from tests.unit.recording.by_message import signals_by_message

GOLDEN = Path(__file__).parents[2] / "golden" / "session.mcap"
START_NS = session.START_NS
TOPICS: dict[str, type[Message]] = {
    "camera/corners": MarkerCorners,
    "camera/plate": MarkerCorners,
    "camera/geometry": CameraGeometry,
    "block/pose": BlockPose,
    "arm/platform": PlatformState,
    "arm/command": TiltCommand,
    "arm/motion": MotionReport,
    "session/event": RunEvent,
    "session/sample": Sample,
    "environment": Environment,
    "angle/imu": AngleReading,
}
Payload = tuple[str, int, int, bytes]
"""Topic, receive and publish time, bytes."""


def flat(value: object) -> Iterator[tuple[str, bytes]]:
    """Everything in the signals as types and bytes."""
    if isinstance(value, np.ndarray):
        yield (
            f"{value.dtype} {value.shape}",
            repr(value.tolist()).encode() if value.dtype == object else value.tobytes(),
        )
    elif isinstance(value, Signals | Track):
        for spec in dataclasses.fields(value):
            yield spec.name, b""
            yield from flat(getattr(value, spec.name))
    elif isinstance(value, dict):
        for key in sorted(value):
            yield str(key), b""
            yield from flat(value[key])
    else:
        yield repr(value), b""


def assert_same(path: Path) -> Signals:
    reader = open_recording(path)
    found = load_signals(reader)
    for mine, wanted in zip(flat(found), flat(signals_by_message(reader)), strict=True):
        assert mine == wanted
    return found


def write(path: Path, payloads: list[Payload], *, chunk_bytes: int = 2000, index: bool = True) -> Path:
    with path.open("wb") as stream:
        file = McapFile(stream, library="test", chunk_bytes=chunk_bytes)
        channels = {
            topic: file.register_channel(
                f"/{topic}", schema_id=file.register_schema(wire.schema_name(cls), wire.schema(cls))
            )
            for topic, cls in TOPICS.items()
        }
        for number, (topic, log_ns, publish_ns, payload) in enumerate(payloads):
            file.add_message(channels[topic], log_ns=log_ns, publish_ns=publish_ns, sequence=number, payload=payload)
        file.finish()
    if not index:
        data = path.read_bytes()
        path.write_bytes(_with_false_indexes(data))
    return path


def _with_false_indexes(data: bytes) -> bytes:
    """Every message index points a byte too far; no checksum covers them."""
    changed, position = bytearray(data), 8
    while position < len(data) - 8:
        opcode, length = data[position], int.from_bytes(data[position + 1 : position + 9], "little")
        if opcode == 7:
            for place in range(position + 23, position + 9 + length, 16):
                changed[place : place + 8] = (int.from_bytes(data[place : place + 8], "little") + 1).to_bytes(
                    8, "little"
                )
        position += 9 + length
    assert changed != data
    return bytes(changed)


def mixed(rng: np.random.Generator, count: int = 400) -> list[Payload]:
    """Messages of every topic with values of all sizes: late ones, equal times, impossible ones among them."""

    def number() -> int:
        return int(rng.integers(-(1 << 62), 1 << 62)) >> int(rng.integers(0, 62))

    def one(cls: type[Message]) -> Message:
        values: dict[str, object] = {}
        for spec in dataclasses.fields(cls):
            kind = {"int": number(), "float": float(rng.choice([0.0, -0.0, np.nan, rng.normal()]))}.get(str(spec.type))
            if kind is None:
                size = int(rng.choice([0, 3, 4, 8, 9]))
                kind = {
                    "bool": bool(rng.integers(2)),
                    "str": str(rng.choice(["", "SLIP", "at rest on one face", "zu spät °", "x" * 300])),
                    "Floats": tuple(rng.normal(size=size).tolist()),
                    "Ints": tuple(number() for _ in range(size)),
                    "Strings": ("a", "b"),
                }[str(spec.type)]
            values[spec.name] = kind
        if "marker_id" in values:
            values["marker_id"] = int(rng.integers(3))
        return cls(**values)  # pyright: ignore[reportArgumentType]: names and values of the class

    found: list[Payload] = []
    for place in range(count):
        topic = str(rng.choice(list(TOPICS)))
        log_ns = START_NS + place // 3 * 1_000_000
        publish_ns = log_ns - int(rng.integers(4)) * 1_000_000
        message = one(TOPICS[topic])
        while message.impossible() and place % 4:
            message = one(TOPICS[topic])
        found.append((topic, log_ns, publish_ns, wire.encode(message)))
    return found


def varint(value: int) -> bytes:
    return encoder._VarintBytes(value)  # pyright: ignore


def test_the_golden_recording() -> None:
    assert len(assert_same(GOLDEN).corners) > 100


def test_the_tests_recording(tmp_path: Path) -> None:
    assert len(assert_same(session.record(tmp_path / "a.mcap")).corners) == 360


@pytest.mark.parametrize("index", [True, False])
def test_values_of_all_sizes(tmp_path: Path, index: bool) -> None:
    payloads = mixed(np.random.default_rng(3))
    found = assert_same(write(tmp_path / "a.mcap", payloads, index=index))
    assert len(found.fiducials) == 3
    assert not found.corners.found.all()
    assert (found.corners.corner_dt_ns < 0).any()


def test_what_other_writers_may_do(tmp_path: Path) -> None:
    """Fields in another order or twice, lists in pieces, unknown fields, numbers longer than they need to be."""
    whole = MarkerCorners(START_NS, 5, tuple(range(8)), 0.5, 0.25, 7, (1, 2, 3, -4), found=True)
    usual = wire.encode(whole)
    halved = wire.encode(replace(whole, corner_dt_ns=(1, 2)))
    odd = [
        usual + varint(2 << 3) + varint(9),  # the number again, at the end: the last one counts
        usual + varint(77 << 3) + varint(9),
        usual + varint(78 << 3 | 2) + varint(3) + b"abc",
        varint(12 << 3) + b"\x01" + usual,
        halved + b"".join(varint(7 << 3) + varint(value) for value in (5, 6)),
        varint(2 << 3) + b"\x85\x80\x80\x00",
        varint(3 << 3 | 2) + varint(0),
        varint(4 << 3) + varint(1),  # a number where a fraction is expected is an unknown field
        b"",  # no message at all
    ]
    payloads = [("camera/corners", START_NS + place, START_NS, payload) for place, payload in enumerate(odd)]
    found = assert_same(write(tmp_path / "a.mcap", payloads, chunk_bytes=10**6))
    assert found.corners.seq.tolist() == [9, 5, 5, 5, 5, 5, 0, 0]


def test_what_no_mark_can_be_is_left_out_and_counted(tmp_path: Path) -> None:
    """Corners that were found are eight finite numbers; a list of another length is no list of corners."""
    found = MarkerCorners(START_NS, 5, tuple(range(8)), found=True)
    wrong = [
        replace(found, corners_px=(1.0, 2.0, 3.0)),
        replace(found, corners_px=()),
        replace(found, corners_px=(math.nan, *range(7))),
        replace(found, corner_dt_ns=(1, 2, 3)),
    ]
    every = [found, *wrong, found]
    payloads = [("camera/corners", START_NS + place, START_NS, wire.encode(one)) for place, one in enumerate(every)]
    path = write(tmp_path / "a.mcap", payloads)
    assert len(assert_same(path).corners) == 2
    reader = open_recording(path)
    load_signals(reader)
    assert reader.malformed == {"camera/corners": 4}


def test_what_no_attitude_can_be_is_left_out_and_counted(tmp_path: Path) -> None:
    """A number so small that its square is zero ended whoever divided by its length."""
    values = (1.0, 1e-320, 0.4, 1e200, math.nan, 0.0, -1.0)
    payloads = [("arm/platform", START_NS + place, START_NS, _turned(qw)) for place, qw in enumerate(values)]
    path = write(tmp_path / "a.mcap", payloads)
    assert len(assert_same(path).attitude) == 2
    reader = open_recording(path)
    load_signals(reader)
    assert reader.malformed == {"arm/platform": 5}


@pytest.mark.parametrize("value", [math.nan, -math.inf, 1e300, 1.1e9])
def test_numbers_beyond_all_rigs_are_left_out_and_counted(tmp_path: Path, value: float) -> None:
    """A pivot that is no number ended a diagnosis, and corners at 1e300 px a simulation never."""
    mark = MarkerCorners(START_NS, corners_px=tuple(range(8)), found=True)
    every: dict[str, tuple[Message, Message]] = {
        "arm/platform": (PlatformState(START_NS), PlatformState(START_NS, px=value)),
        "camera/corners": (mark, replace(mark, corners_px=(value,) * 8)),
        "camera/plate": (mark, replace(mark, sigma_px=value)),
        "block/pose": (BlockPose(START_NS, found=True), BlockPose(START_NS, x=value, found=True)),
        "arm/command": (TiltCommand(START_NS), TiltCommand(START_NS, rate_rad_s=value)),
        "angle/imu": (AngleReading(START_NS), AngleReading(START_NS, gravity_x=value)),
    }
    payloads = [(topic, START_NS, START_NS, wire.encode(one)) for topic, both in every.items() for one in both]
    path = write(tmp_path / "a.mcap", payloads)
    found = assert_same(path)
    assert len(found.attitude) == len(found.corners) == len(found.commands) == 1
    reader = open_recording(path)
    load_signals(reader)
    assert reader.malformed == dict.fromkeys(every, 1)


def test_one_long_text_does_not_give_every_text_its_room(tmp_path: Path) -> None:
    """An array of texts of one width took a megabyte and more for each of them."""
    texts = ["at rest", "B" * 1_000_000, *["slid"] * 2000]
    payloads = [
        ("session/event", START_NS + place, START_NS + place, wire.encode(RunEvent(START_NS, phase=text, reason=text)))
        for place, text in enumerate(texts)
    ]
    path = write(tmp_path / "a.mcap", payloads)
    tracemalloc.start()
    events = load_signals(open_recording(path)).events
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert events.reason.tolist() == [text[:LETTERS] for text in texts]
    assert (events.phase == "slid").sum() == 2000
    assert peak < 100e6


def _turned(qw: float) -> bytes:
    return wire.encode(PlatformState(START_NS, qw=qw))


def _outcome(path: Path, *, whole: bool) -> list[tuple[str, bytes]] | str:
    try:
        reader = open_recording(path)
        return list(flat(load_signals(reader) if whole else signals_by_message(reader)))
    except UserError as error:
        return str(error)


def test_damage_is_told_in_the_same_words(tmp_path: Path) -> None:
    """A flipped bit or a cut anywhere: the same sentence, or the same signals."""
    rng, data = np.random.default_rng(5), GOLDEN.read_bytes()
    path, faults = tmp_path / "a.mcap", 0
    for place in rng.integers(0, len(data), 16).tolist():
        changed = bytearray(data)
        changed[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(changed)
        found = _outcome(path, whole=True)
        assert found == _outcome(path, whole=False)
        faults += isinstance(found, str)
    assert faults > 5
    path.write_bytes(data[: len(data) // 2])
    assert _outcome(path, whole=True) == _outcome(path, whole=False)


def test_payloads_that_do_not_parse_are_left_out_alike(tmp_path: Path) -> None:
    """The file stays readable whatever one sender wrote, and says how many payloads were none."""
    rng = np.random.default_rng(6)
    payloads = [one for one in mixed(rng, 90) if not _parsed(one).impossible()]
    left_out = 0
    for place in range(40):
        topic, log_ns, publish_ns, payload = payloads[place]
        broken = bytearray(payload[: int(rng.integers(1, len(payload) + 1))])
        broken[int(rng.integers(len(broken)))] = int(rng.integers(256))
        changed = [*payloads[:place], (topic, log_ns, publish_ns, bytes(broken)), *payloads[place + 1 :]]
        path = write(tmp_path / "a.mcap", changed)
        assert_same(path)
        reader = open_recording(path)
        load_signals(reader)
        assert sum(reader.malformed.values()) <= 1
        left_out += sum(reader.malformed.values())
    assert left_out > 10


def _parsed(payload: Payload) -> Message:
    topic, *_, content = payload
    return wire._from_proto(TOPICS[topic], wire._proto_class(TOPICS[topic]).FromString(content))  # pyright: ignore[reportPrivateUsage]: unchecked


def test_a_topic_that_carries_something_else_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with path.open("wb") as stream:
        file = McapFile(stream, library="test")
        schema = file.register_schema(wire.schema_name(BlockPose), wire.schema(BlockPose))
        channel = file.register_channel("/arm/platform", schema_id=schema)
        file.add_message(channel, log_ns=1, publish_ns=1, sequence=0, payload=wire.encode(BlockPose(stamp_ns=1)))
        file.finish()
    with pytest.raises(UserError, match=r"Expected repose\.PlatformState on .* arm/platform, got repose\.BlockPose"):
        load_signals(open_recording(path))
