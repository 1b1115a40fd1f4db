"""The writer's own counts by topic, and what a copy of the file lacks by them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest

from station.__main__ import main
from station.app.verifying import verify
from station.recording.checkup.report import examine
from station.recording.checkup.rules import findings
from station.recording.counts import METADATA, counts_record, miscounted
from station.recording.reader import open_recording
from station.recording.repair import copy_without, repair
from station.recording.writer import Recording, partial_path
from tests.unit.app.forging import Edit, Item, forged
from tests.unit.recording import session


def without_one(topic: str) -> Edit:
    """The same without the first message of a topic."""

    def edit(items: Iterator[Item]) -> Iterable[Item]:
        left_out = False
        for item in items:
            if item.topic == topic and not left_out:
                left_out = True
                continue
            yield item

    return edit


def test_the_counts_of_a_recording_are_those_of_its_messages(tmp_path: Path) -> None:
    reader = open_recording(session.record(tmp_path / "a.mcap"))
    held = {f"/{name}": str(info.count) for name, info in reader.topics.items() if not name.startswith("truth/")}
    assert reader.metadata[METADATA] == held
    assert (reader.miscounted, reader.changed_metadata) == ((), ())


def test_a_message_that_a_copy_loses_is_told(tmp_path: Path) -> None:
    """Lines of the log were lost without a word: nothing derives from them, and no count was compared."""
    whole = session.record(tmp_path / "a.mcap")
    copy = forged(whole, tmp_path / "b.mcap", without_one("camera/status"))
    sentence = "expected 4 messages on /camera/status, found 3"
    assert open_recording(copy).miscounted == (sentence,)
    broken = [finding.sentence for finding in findings(examine(open_recording(copy))) if finding.rule == "count"]
    assert broken == [f"{sentence}: they were counted when it was written"]
    (content,) = (part for part in verify(copy).parts if part.name == "content")
    assert (content.state, content.sentence) == ("different", sentence)


def test_a_copy_that_loses_a_whole_topic_or_gains_one_is_told(tmp_path: Path) -> None:
    record = counts_record({"log": 2, "clock": 1})
    assert [*miscounted(record, {"clock": 1})] == ["expected 2 messages on /log, found 0"]
    assert [*miscounted(record, {"clock": 1, "log": 2, "tf": 3})] == ["expected 0 messages on /tf, found 3"]


@pytest.mark.parametrize("value", ["many", "-1", "1e9", ""])
def test_a_count_that_is_none_agrees_with_nothing(value: str) -> None:
    assert [*miscounted({"/log": value}, {"log": 2})] == ["expected a number of messages on /log, found 2"]


def test_the_truth_may_be_taken_out(tmp_path: Path) -> None:
    assert counts_record({"truth/scene": 2, "log": 1}) == {"/log": "1"}
    copy = forged(session.record(tmp_path / "a.mcap"), tmp_path / "b.mcap", without_one("truth/scene"))
    assert open_recording(copy).miscounted == ()


def test_a_file_that_was_never_finished_has_no_counts(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    recording = Recording(path, provenance=session.provenance())
    for receive_ns, topic, message in session.traffic():
        recording.write_message(topic, message, receive_ns=receive_ns)
    recording.flush()
    recording.let_go()
    repair(partial_path(path))
    reader = open_recording(path)
    assert METADATA not in reader.metadata
    assert reader.miscounted == ()


def test_a_copy_without_a_topic_is_no_loss(tmp_path: Path) -> None:
    copy_without(session.record(tmp_path / "a.mcap"), tmp_path / "b.mcap", drop=lambda topic: topic == "clock")
    assert open_recording(tmp_path / "b.mcap").miscounted == ()


def test_a_damaged_file_that_was_finished_tells_what_its_repair_lost(tmp_path: Path) -> None:
    path = session.record(tmp_path / "a.mcap")
    chunk = open_recording(path).summary.chunk_indexes[0]
    content = bytearray(path.read_bytes())
    content[chunk.chunk_start_offset + chunk.chunk_length // 2] ^= 1
    path.write_bytes(content)
    assert main(["repair", str(path), "--out", str(tmp_path / "b.mcap")]) == 0
    assert open_recording(tmp_path / "b.mcap").miscounted
