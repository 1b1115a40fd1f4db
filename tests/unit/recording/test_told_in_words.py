"""The content of a file that others wrote is told in a sentence, or left out and counted: never a traceback."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from shared import wire
from shared.config import Table, load_table, parse
from shared.errors import UserError
from shared.messages import Heartbeat, Message, RunEvent, Sample
from shared.rig import BlockConfig
from station.__main__ import main
from station.export.reading import read_pairs
from station.recording.mcap_file import McapFile
from station.recording.reader import open_recording
from station.recording.tables import read_samples, write_samples

GOOD_NS = 1_600_000_000_000_000_000


def recorded(
    path: Path,
    message: Message,
    *,
    topic: str,
    log_ns: int = GOOD_NS,
    publish_ns: int = GOOD_NS,
    metadata: dict[str, str] | None = None,
) -> Path:
    """A file with one message, as a foreign writer may lay it out."""
    with path.open("wb") as stream:
        file = McapFile(stream, library="test")
        schema = file.register_schema(wire.schema_name(type(message)), wire.schema(type(message)))
        channel = file.register_channel("/" + topic, schema_id=schema)
        file.add_message(channel, log_ns=log_ns, publish_ns=publish_ns, sequence=0, payload=wire.encode(message))
        file.add_metadata("session", metadata or {})
        file.finish()
    return path


@pytest.mark.parametrize("value", ["no number", "-1", "²", "9" * 30])
def test_metadata_that_was_changed_ends_no_doctor(
    tmp_path: Path, value: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = recorded(tmp_path / "a.mcap", Heartbeat(), topic="session/heartbeat", metadata={"started_ns": value})
    assert main(["doctor", str(path)]) == 1
    assert "expected" in capsys.readouterr().out


@pytest.mark.parametrize("topic", ["camera/corners", "session/sample", "arm/platform", "log"])
def test_a_topic_with_anothers_schema_is_unknown(tmp_path: Path, topic: str) -> None:
    recording = open_recording(recorded(tmp_path / "a.mcap", RunEvent(phase="TILT"), topic=topic))
    assert list(recording.messages()) == []
    assert recording.topics[topic].message is None
    assert recording.samples() == ()
    assert main(["replay", str(tmp_path / "a.mcap"), "--no-viewer", "--save", str(tmp_path / "a.rrd")]) == 0


@pytest.mark.parametrize("stamps", [{"publish_ns": 2**63}, {"log_ns": 2**64 - 1}, {"publish_ns": 2**64 - 1}])
def test_a_message_from_beyond_the_year_2262_is_left_out_and_counted(tmp_path: Path, stamps: dict[str, int]) -> None:
    recording = open_recording(recorded(tmp_path / "a.mcap", Heartbeat(), topic="session/heartbeat", **stamps))  # pyright: ignore[reportArgumentType]
    assert list(recording.messages(to_ns=2**64)) == []
    assert recording.malformed == {"session/heartbeat": 1}
    assert main(["replay", str(tmp_path / "a.mcap"), "--no-viewer", "--save", str(tmp_path / "a.rrd")]) == 0


def test_brackets_in_a_text_are_printed_as_they_are(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = tmp_path / "samples.csv"
    write_samples((Sample(run=1, onset_angle_rad=0.3, flags=("[/red]",)),), table)
    assert main(["samples", str(table)]) == 0
    assert "[/red]" in capsys.readouterr().out
    path = recorded(tmp_path / "a.mcap", RunEvent(phase="[/red]"), topic="session/event", metadata={"mode": "[/red]"})
    assert main(["doctor", str(path)]) == 1
    assert "[/red]" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("column", "cell"),
    [("run", str(2**70)), ("start_ns", "9" * 5000)],
)
def test_a_number_that_no_sample_holds_is_named(tmp_path: Path, column: str, cell: str) -> None:
    table = tmp_path / "samples.csv"
    table.write_text(f"onset_angle_rad,{column}\n0.3,{cell}\n", encoding="utf-8")
    with pytest.raises(UserError, match=f"row 1: expected .* for '{column}'") as refused:
        read_samples(table)
    assert len(str(refused.value)) < 300


@pytest.mark.parametrize(
    "columns",
    [
        {"onset_angle_rad": [0.3], "run": [float("inf")]},
        {"onset_angle_rad": [{"a": 1}]},
        {"onset_angle_rad": [0.3], "euler_rad": [{"a": 1.0}]},
        {"onset_angle_rad": [b"x"]},
        {"onset_angle_rad": [0.3], "flags": [3]},
    ],
)
def test_a_parquet_table_of_odd_columns_is_told(tmp_path: Path, columns: dict[str, Any]) -> None:
    table = tmp_path / "samples.parquet"
    pq.write_table(pa.table(columns), table)
    with pytest.raises(UserError, match="expected"):
        read_samples(table)


def test_two_columns_of_one_name_are_told(tmp_path: Path) -> None:
    table = tmp_path / "samples.parquet"
    pq.write_table(pa.table([pa.array([0.3]), pa.array([0.4])], names=["onset_angle_rad"] * 2), table)
    with pytest.raises(UserError, match="Expected a Parquet table"):
        read_samples(table)


@pytest.mark.parametrize(
    "table",
    [
        "[" * 100_000,
        json.dumps({"pairs": [{"object": "a", "plate": "b", "fit": []}]}),
        json.dumps({"pairs": [{"object": "a", "plate": "b", "fit": {"family": 3}}]}),
        json.dumps({"pairs": [{"object": "a", "plate": "b", "fit": {"parameters": {"mu": 1e400}}}]}),
        json.dumps({"pairs": 3}),
    ],
)
def test_limit_curves_that_are_none_are_told(tmp_path: Path, table: str) -> None:
    path = tmp_path / "limit_curves.json"
    path.write_text(table, encoding="utf-8")
    with pytest.raises(UserError, match=r"Expected limit_curves\.json"):
        read_pairs(path)


@pytest.mark.parametrize("text", ["a = " + "[" * 50_000, "a = " + "9" * 5000])
def test_a_toml_file_that_goes_too_deep_or_too_far_is_told(tmp_path: Path, text: str) -> None:
    path = tmp_path / "rig.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(UserError, match="expected TOML"):
        load_table(path)


def test_a_whole_number_that_is_no_fraction_is_told() -> None:
    with pytest.raises(UserError, match="expected a number for 'mass_kg'"):
        parse(BlockConfig, Table({"mass_kg": 10**400}))


@pytest.mark.parametrize("column", ["euler_rad_0", "block_mass_kg", "onset_sigma_rad"])
def test_an_infinite_number_is_no_measurement(tmp_path: Path, column: str, capsys: pytest.CaptureFixture[str]) -> None:
    table = tmp_path / "samples.csv"
    table.write_text(f"onset_angle_rad,{column}\n0.3,inf\n0.3,0.1\n", encoding="utf-8")
    assert main(["analyze", str(table)]) == 2
    assert f"expected a finite {column.removesuffix('_0')}" in capsys.readouterr().err
