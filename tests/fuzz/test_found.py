"""Every input that fuzzing found is refused in a sentence now, or shown without harm: one test each."""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding

from shared import wire
from shared.bus_keys import members_in
from shared.clock import SIMULATION_EPOCH_NS
from shared.errors import UserError
from shared.geometry import tilt_of
from shared.messages import Heartbeat, PlatformState, RunEvent, Sample
from shared.rig import load_rig
from shared.visible import LONGEST, sentence, visible
from station.__main__ import main
from station.app.authority import new_authority
from station.app.signing import sign, signature_of
from station.arm.attitude import Attitude
from station.arm.drivers import JointReading
from station.friction.onset import estimate_onset
from station.physics.catalogue import catalogue
from station.physics.model import model_of_table
from station.recording import mcap_file
from station.recording.importers import importers
from station.recording.mcap_file import McapFile
from station.recording.reader import open_recording
from tests.fuzz import seeds
from tests.fuzz.target import Unclear
from tests.fuzz.targets import arm
from tests.unit.app.forging import Item, forged
from tests.unit.recording.test_importers import made_up

CLEAR = "\x1b[2J"


@pytest.fixture
def bench(tmp_path: Path) -> Path:
    path = tmp_path / "bench.mcap"
    path.write_bytes(seeds.bench())
    return path


@pytest.mark.parametrize("command", ["doctor", "verify", "check"])
def test_a_recording_does_not_command_the_terminal(
    bench: Path, tmp_path: Path, command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    def edit(items: Iterator[Item]) -> Iterable[Item]:
        for item in items:
            if isinstance(item.message, RunEvent):
                yield item.with_message(replace(item.message, phase=CLEAR))
            else:
                yield item

    main([command, str(forged(bench, tmp_path / "forged.mcap", edit))])
    told = capsys.readouterr()
    assert "\x1b" not in told.out + told.err
    assert command != "doctor" or "␛[2J" in told.out


@pytest.mark.parametrize("words", [["repair"], ["repair", "folder"], ["samples", "--digest"], ["doctor"]])
def test_the_name_of_a_topic_does_not_command_the_terminal(
    tmp_path: Path, words: list[str], capsys: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    """Its payload is none, so its name is told: in what is printed, and in the warning, which comes once a topic."""
    path = tmp_path / ("a.mcap.partial" if words[0] == "repair" else "a.mcap")
    with path.open("wb") as stream:
        file = McapFile(stream, library="test")
        schema = file.register_schema(wire.schema_name(Sample), wire.schema(Sample))
        channel = file.register_channel(f"/{CLEAR}", schema_id=schema)
        file.add_message(channel, log_ns=1, publish_ns=1, sequence=0, payload=b"\xff" * 9)
        file.finish()
    given = str(tmp_path if "folder" in words else path)
    main([words[0], given, *(word for word in words[1:] if word.startswith("-"))])
    told = capsys.readouterr().out + caplog.text
    assert "\x1b" not in told
    assert "␛[2J" in told


def test_control_characters_are_shown_and_long_sentences_lose_their_middle() -> None:
    assert visible("a\x00b\x7f\x9b\tc\nd") == "a␀b␡\ufffd\tc\nd"
    assert sentence("short") == "short"
    assert len(sentence("x" * 10_000)) <= LONGEST
    assert sentence(sentence("x" * 10_000)) == sentence("x" * 10_000)


def test_an_index_that_claims_any_length_takes_no_memory(
    bench: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = mcap_file.ChunkIndex

    def claims(**values: int) -> object:
        return whole(**(values | {"message_index_length": 2**62}))  # pyright: ignore[reportArgumentType]

    monkeypatch.setattr(mcap_file, "ChunkIndex", claims)
    path = tmp_path / "claims.mcap"
    with path.open("wb") as stream:
        file = McapFile(stream, library="test")
        schema = file.register_schema("repose.Sample", b"")
        channel = file.register_channel("/session/sample", schema_id=schema)
        file.add_message(channel, log_ns=1, publish_ns=1, sequence=0, payload=wire.encode(Sample(run=1)))
        file.finish()
    reader = open_recording(path)
    assert len(reader.samples()) == 1
    assert bench.exists()


@pytest.mark.parametrize(
    "table",
    [
        {"friction": 0.3},
        {"friction": {"mu_s": 10**400}},
        {"friction": {"mu_s": 0.3}, "effects": 3},
        {"friction": {"mu_s": 0.3}, "effects": {"kinetic_drop": 3}},
    ],
)
def test_a_model_of_other_kinds_is_refused(table: dict[str, object]) -> None:
    with pytest.raises(UserError, match="Expected"):
        model_of_table(table, catalogue())


@pytest.mark.parametrize(
    "changed",
    [
        {"object": 3},
        {"object": "\ud800"},
        {"remarks": ["\ud800"]},
        {"side_m": 1e200},
        {"axis_rad": math.inf},
        {"one_way_rad": None},
        {"mass_kg": 1e-320},
        {"mu_1_interval": [1, 2, 3]},
        {"axis_rad": "0"},
        {"samples": 10**400},
        {"remarks": "a doubt"},
    ],
)
def test_a_pair_of_other_kinds_is_refused(
    changed: dict[str, object], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pair = {"object": "a", "plate": "b", "mu_1": 0.4, "mu_2": 0.3, **changed}
    path = tmp_path / "friction_pairs.json"
    path.write_text(json.dumps({"format": "friction pairs", "pairs": [pair]}), encoding="utf-8")
    assert main(["export", str(path), "--out", str(tmp_path / "out")]) == 2
    assert "xpected" in capsys.readouterr().err


def test_rights_that_are_no_lists_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "rights.toml"
    path.write_text('rig = "lab"\n[members]\ncamera = 3\n', encoding="utf-8")
    with pytest.raises(UserError, match="with lists for"):
        members_in(path, "lab")


@pytest.mark.parametrize(
    ("name", "value"), [("frame", 1e300), ("toss", 1e300), ("x_m", 1e300), ("x_m", float("nan")), ("frame", 10.0**9)]
)
def test_tosses_that_cannot_be_are_refused(name: str, value: float, tmp_path: Path) -> None:
    """Frames of a billion would make months of messages, and none of them of a toss."""
    table = pq.read_table(made_up(tmp_path / "whole.parquet")).to_pydict()
    table[name] = [value] * len(table[name])
    if name == "x_m":
        table["y_m"] = table[name]
    path = tmp_path / "tosses.parquet"
    pq.write_table(pa.table({column: pa.array(values, pa.float64()) for column, values in table.items()}), path)
    with pytest.raises(UserError, match="Expected"):
        importers()["cube-tosses"].read(path)


def test_tosses_that_take_hours_are_refused(tmp_path: Path) -> None:
    """Each frame is within an hour; the board's attitude, a hundred times a second, would take a gigabyte."""
    table = pq.read_table(made_up(tmp_path / "whole.parquet")).to_pydict()
    rows = len(table["frame"])
    table["toss"] = [row // 2 for row in range(rows)]
    table["frame"] = [row % 2 * 148 * 600 for row in range(rows)]
    path = tmp_path / "tosses.parquet"
    pq.write_table(pa.table(table), path)
    with pytest.raises(UserError, match="at most 3600 s together"):
        importers()["cube-tosses"].read(path)


@pytest.mark.parametrize("cell", [{"a": 1}, "x"])
def test_tosses_in_columns_that_hold_no_numbers_are_refused(tmp_path: Path, cell: object) -> None:
    whole = pq.read_table(made_up(tmp_path / "whole.parquet"))
    path = tmp_path / "tosses.parquet"
    pq.write_table(whole.set_column(2, "x_m", pa.array([cell] * whole.num_rows)), path)
    with pytest.raises(UserError, match="Expected numbers"):
        importers()["cube-tosses"].read(path)


def test_a_column_of_texts_that_are_all_missing_has_no_place_on_the_board(tmp_path: Path) -> None:
    whole = pq.read_table(made_up(tmp_path / "whole.parquet"))
    path, empty = tmp_path / "tosses.parquet", pa.array([None] * whole.num_rows, pa.string())
    pq.write_table(whole.set_column(2, "x_m", empty).set_column(3, "y_m", empty), path)
    with pytest.raises(UserError, match="Expected"):
        importers()["cube-tosses"].read(path)


def test_a_table_whose_columns_have_no_names_is_refused(tmp_path: Path) -> None:
    """A byte of a name changed to one that begins no letter."""
    path = made_up(tmp_path / "tosses.parquet")
    table = pq.read_table(path).rename_columns(["@oss", *pq.read_table(path).column_names[1:]])
    pq.write_table(table.replace_schema_metadata(None), path, store_schema=False)
    path.write_bytes(path.read_bytes().replace(b"@oss", b"\x80oss"))
    with pytest.raises(UserError, match="Expected a Parquet table"):
        importers()["cube-tosses"].read(path)


def test_an_attitude_of_numbers_whose_squares_are_zero_has_a_tilt() -> None:
    assert tilt_of(1e-320, 0.0, 0.0, 0.0) == 0.0
    assert tilt_of(0.0, 1e-320, 0.0, 0.0) == pytest.approx(math.pi)


def test_a_reading_of_hours_later_is_no_part_of_a_slide() -> None:
    """A grid of milliseconds to the year 2262 asked for 55 TiB."""
    frames = SIMULATION_EPOCH_NS + np.arange(20) * 10_000_000
    times = np.append(frames, 2**63 - 1)
    onset = estimate_onset(frames, np.arange(20) * 1e-3, tilt_ns=times, tilt_rad=np.linspace(0, 0.3, 21), sigma_m=1e-5)
    assert onset is None


def _unreadable(certificate: bytes) -> Iterator[str]:
    """Certificates with one bit changed: one of a version that there is not, and one whose name cannot be read."""
    der = x509.load_pem_x509_certificate(certificate).public_bytes(Encoding.DER)
    version = der.index(bytes([0xA0, 3, 2, 1, 2])) + 4
    name = der.index(bytes([0x55, 4, 3, 0x0C]), version) + 3  # the mark of the text in a common name
    for place, bit in ((version, 0x40), (name, 0x02)):
        changed = der[:place] + bytes([der[place] ^ bit]) + der[place + 1 :]
        yield f"-----BEGIN CERTIFICATE-----\n{base64.encodebytes(changed).decode()}-----END CERTIFICATE-----\n"


def test_what_the_arm_agent_is_told_is_not_what_it_sends(tmp_path: Path) -> None:
    """A heartbeat of zeros that are written out is a message, and is no payload at all when it is written anew."""
    payload = b"\x08\x00"
    assert wire.encode(wire.decode(Heartbeat, payload)) == b""
    path = tmp_path / "script.json"
    path.write_text(json.dumps([(3, "session/heartbeat", payload.hex())]), encoding="utf-8")
    arm.TARGETS[0].read(path)


def test_an_arm_agent_that_sends_what_nobody_can_take_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def of_no_attitude(attitude: Attitude, reading: JointReading) -> PlatformState:
        del attitude, reading
        return PlatformState(qw=0.0)

    monkeypatch.setattr(Attitude, "state", of_no_attitude)
    path = tmp_path / "script.json"
    path.write_text("[]", encoding="utf-8")
    with pytest.raises(Unclear, match="sends what nobody can take: PlatformState"):
        arm.TARGETS[0].read(path)


def test_a_certificate_whose_name_cannot_be_read_signs_nothing(tmp_path: Path) -> None:
    (tmp_path / "rig.toml").write_text('id = "lab"\n', encoding="utf-8")
    new_authority(load_rig(tmp_path / "rig.toml"), tmp_path / "keys")
    (tmp_path / "a.mcap").write_bytes(b"content")
    beside = sign(tmp_path / "a.mcap", tmp_path / "keys", now_ns=1)
    told = json.loads(beside.read_text())
    for certificate in _unreadable(told["certificate"].encode()):
        beside.write_text(json.dumps({**told, "certificate": certificate}))
        with pytest.raises(UserError, match="expected a signature"):
            signature_of(tmp_path / "a.mcap", sha256=told["sha256"], keys=tmp_path / "keys")
