"""Every message that is none of its topic is counted once, however often and by whichever way it is read."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import pytest

from shared import wire
from shared.bus import Received
from shared.messages import Message, RunEvent, Sample
from station.__main__ import main
from station.recording.arrays import load_signals
from station.recording.mcap_file import McapFile
from station.recording.reader import RecordingReader, open_recording
from station.recording.repair import repair
from station.recording.writer import Recording
from tests.unit.recording import session

GOOD_NS = 1_600_000_000_000_000_000
JUNK = b"\xff" * 13
Row = tuple[Message | bytes, int, int]
"""A message or a payload that is none, with its log and its publish time."""


def written(path: Path, rows: Sequence[Row], *, cls: type[Message] = Sample, chunk_bytes: int = 1 << 20) -> Path:
    topic = "session/sample" if cls is Sample else "session/event"
    with path.open("wb") as stream:
        file = McapFile(stream, library="test", chunk_bytes=chunk_bytes)
        schema = file.register_schema(wire.schema_name(cls), wire.schema(cls))
        channel = file.register_channel("/" + topic, schema_id=schema)
        for item, log_ns, publish_ns in rows:
            payload = item if isinstance(item, bytes) else wire.encode(item)
            file.add_message(channel, log_ns=log_ns, publish_ns=publish_ns, sequence=0, payload=payload)
        file.finish()
    return path


def with_junk(path: Path) -> Path:
    """A session in which a payload that is none follows each of its two samples."""
    with Recording(path, provenance=session.provenance()) as recording:
        for receive_ns, topic, message in session.traffic():
            recording.write_message(topic, message, receive_ns=receive_ns)
            if topic == "session/sample":
                recording.write(Received(topic, receive_ns=receive_ns, message=message, payload=JUNK))
    return path


def read_every_way(reader: RecordingReader) -> dict[str, int]:
    """Returns what is left out when a recording is read twice in each way."""
    for _ in range(2):
        list(reader.messages())
        reader.samples()
        load_signals(reader)
    return reader.malformed


@pytest.mark.parametrize("chunk_bytes", [1, 1 << 20])
@pytest.mark.parametrize("cls", [Sample, RunEvent])
def test_messages_of_one_time_are_counted_each(tmp_path: Path, cls: type[Message], chunk_bytes: int) -> None:
    good = Sample(run=1) if cls is Sample else RunEvent(run=1)
    rows: list[Row] = [(good, GOOD_NS, GOOD_NS), *[(JUNK, GOOD_NS + place // 5, GOOD_NS) for place in range(10)]]
    path = written(tmp_path / "a.mcap", rows, cls=cls, chunk_bytes=chunk_bytes)
    assert list(read_every_way(open_recording(path)).values()) == [10]


def test_an_empty_payload_and_a_sample_of_no_run_are_counted_whatever_the_topic(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with Recording(path, provenance=session.provenance()) as recording:
        for receive_ns, topic, message in session.traffic(truth=False):
            recording.write_message(topic, message, receive_ns=receive_ns)
            recording.write(Received(topic, receive_ns=receive_ns, message=message, payload=b""))
        recording.write_message("session/sample", Sample(run=-1, onset_angle_rad=0.1), receive_ns=session.START_NS)
    reader = open_recording(path)
    counts = Counter(topic for _, topic, _ in session.traffic(truth=False))
    assert read_every_way(reader) == counts + Counter({"session/sample": 1})
    assert [sample.run for sample in reader.samples()] == [1, 2]


def test_messages_of_several_parts_are_counted_each(tmp_path: Path) -> None:
    """Each message is followed by a payload that is none, received at the same time; two parts alike hold the same."""
    path, rows = tmp_path / "a.mcap", list(session.traffic())
    with Recording(path, provenance=session.provenance(), flush_every_s=0.02, split_bytes=20_000) as recording:
        for receive_ns, topic, message in rows:
            recording.write(Received(topic, receive_ns=receive_ns, message=message))
            recording.write(Received(topic, receive_ns=receive_ns, message=message, payload=JUNK))
    assert len(list(tmp_path.glob("*.mcap"))) > 2
    found = read_every_way(open_recording(path))
    assert found["camera/corners"] == sum(topic == "camera/corners" for _, topic, _ in rows)
    assert found["session/sample"] == 2


INDEXES = "station.recording.in_batches.batch_of"


@pytest.mark.parametrize("indexed", [True, False])
@pytest.mark.parametrize(("log_ns", "publish_ns"), [(2**64 - 1, GOOD_NS), (GOOD_NS, 2**63), (2**63, 2**63)])
def test_a_stamp_past_all_clocks_is_left_out_and_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, log_ns: int, publish_ns: int, *, indexed: bool
) -> None:
    """With and without message indexes: without them, records are read one after another."""
    if not indexed:
        monkeypatch.setattr(INDEXES, lambda *_, **__: None)  # pyright: ignore[reportUnknownLambdaType]
    rows: list[Row] = [(Sample(run=1), GOOD_NS, GOOD_NS), (Sample(run=2), log_ns, publish_ns)]
    reader = open_recording(written(tmp_path / "a.mcap", rows))
    assert [sample.run for sample in reader.samples()] == [1]
    assert read_every_way(reader) == {"session/sample": 1}


def test_samples_says_how_many_it_leaves_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path / "a.mcap", [(JUNK, GOOD_NS, GOOD_NS)] * 2 + [(Sample(run=1), GOOD_NS, 2**63)])
    assert main(["samples", str(path)]) == 0
    assert "3 on /session/sample" in capsys.readouterr().out


def test_samples_of_many_say_how_many_they_leave_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    path = written(tmp_path / "a.mcap", [(JUNK, GOOD_NS, GOOD_NS)] * 2 + [(Sample(run=1), GOOD_NS, 2**63)])
    other = written(tmp_path / "b.mcap", [(Sample(run=1), GOOD_NS, GOOD_NS)])
    assert main(["samples", path.name, other.name, "--jobs", "1"]) == 0
    assert [row.split()[-2:-1] for row in capsys.readouterr().out.splitlines() if ".mcap" in row] == [["3"], ["–"]]
    for words in (["samples", str(path), "--json"], ["samples", str(path), "--json", "--digest"]):
        assert main(words) == 0
        (row,) = json.loads(capsys.readouterr().out)
        assert row["left_out"] == {"session/sample": 3}


def test_verify_tells_them_as_json_too_and_also_of_damaged_metadata(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = with_junk(tmp_path / "a.mcap")
    main(["verify", str(path), "--json"])
    assert json.loads(capsys.readouterr().out)["left_out"] == {"session/sample": 2}
    path.write_bytes(path.read_bytes().replace(b"started_ns", b"statted_ns"))
    main(["verify", str(path)])
    told = capsys.readouterr().out
    assert "not as it was written" in told
    assert "2 on /session/sample" in told


def test_check_says_how_many_it_leaves_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = with_junk(tmp_path / "a.mcap")
    for command in ("check", "verify"):
        main([command, str(path)])
        assert "2 on /session/sample" in capsys.readouterr().out


def test_a_repair_says_how_many_no_reader_takes(tmp_path: Path) -> None:
    path = written(tmp_path / "a.mcap", [(JUNK, GOOD_NS, GOOD_NS)] * 2 + [(Sample(run=1), GOOD_NS, 2**63)])
    repaired = repair(path)
    assert "3 on /session/sample" in repaired.sentence
    assert open_recording(repaired.path).metadata["repair"]["malformed"] == "3"
    assert open_recording(repaired.path).message_count == 3
