"""Missing messages are told by the numbers of those around them, also where no counts were recorded."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

import pytest
from mcap.records import Attachment

from station.__main__ import main
from station.app.verified.part import Part
from station.app.verifying import verify
from station.recording.chunks import RawMessage
from station.recording.counts import METADATA, counts_record
from station.recording.mcap_file import McapFile
from station.recording.parts import files_of
from station.recording.reader import open_recording
from station.recording.salvage import Block, Salvage
from tests.unit.recording import session
from tests.unit.recording.test_parts import split

GOLDEN = Path(__file__).parents[2] / "golden" / "session.mcap"
Keep = Callable[[str, int], bool]


def everything(_topic: str, _number: int) -> bool:
    return True


def the_same(number: int) -> int:
    return number


def rewritten(
    source: Path,
    target: Path,
    keep: Keep,
    *,
    number: Callable[[int], int] = the_same,
    counts: Mapping[str, str] = MappingProxyType({}),
) -> Path:
    """Copies a recording with other counts, or none, and of each topic the messages whose number is to be kept."""
    salvage, numbers = Salvage(source), dict[int, int]()
    with target.open("wb") as stream:
        output = McapFile(stream, library="forger")

        def add(raw: RawMessage) -> None:
            channel = salvage.channels[raw.channel_id]
            if not keep(channel.topic, raw.sequence):
                return
            if raw.channel_id not in numbers:
                schema = salvage.schemas[channel.schema_id]
                known = output.register_schema(schema.name, schema.data, encoding=schema.encoding)
                numbers[raw.channel_id] = output.register_channel(
                    channel.topic, schema_id=known, encoding=channel.message_encoding
                )
            output.add_message(
                numbers[raw.channel_id],
                log_ns=raw.log_ns,
                publish_ns=raw.publish_ns,
                sequence=number(raw.sequence),
                payload=raw.payload,
            )

        for item in salvage.read():
            if isinstance(item, Block):
                for raw in item.messages:
                    add(raw)
            elif isinstance(item, Attachment):
                output.add_attachment(item.name, item.data, media_type=item.media_type, stamp_ns=item.log_time)
            elif item.name != METADATA:
                output.add_metadata(item.name, item.metadata)
        if counts:
            output.add_metadata(METADATA, counts)
        output.finish()
    return target


def content(path: Path) -> Part:
    (found,) = (part for part in verify(path).parts if part.name == "content")
    return found


def test_a_third_of_a_topic_that_was_taken_out_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With the record of counts taken out as well, `verify` found the rest identical."""
    less = rewritten(
        GOLDEN, tmp_path / "a.mcap", lambda topic, number: topic != "/camera/calibration" or number % 3 > 0
    )
    found = content(less)
    assert (found.state, found.mismatch and found.mismatch.field) == ("different", "sequence")
    assert "9 of the messages on /camera/calibration are missing by their numbers" in found.sentence
    assert main(["verify", str(less)]) == 1
    assert "✗ content" in capsys.readouterr().out


@pytest.mark.parametrize("command", ["doctor", "check"])
def test_what_was_taken_out_is_told_by_every_check(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """No decision follows from a calibration, so that all of them are the same without it."""
    less = rewritten(
        GOLDEN, tmp_path / "a.mcap", lambda topic, number: topic != "/camera/calibration" or number % 3 > 0
    )
    main([command, str(GOLDEN)])
    assert "by their numbers" not in capsys.readouterr().out
    assert main([command, str(less)]) == 1
    assert "9 of the messages on /camera/calibration are missing by their numbers" in capsys.readouterr().out


@pytest.mark.parametrize("command", ["doctor", "check"])
def test_the_end_of_a_topic_that_was_taken_out_is_told_by_every_check(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """No number tells it, but the record of counts; `check` did not look there."""
    whole = {name: info.count for name, info in open_recording(GOLDEN).topics.items()}
    last = whole["camera/calibration"] - 1
    less = rewritten(
        GOLDEN,
        tmp_path / "a.mcap",
        lambda topic, number: topic != "/camera/calibration" or number < last,
        counts=counts_record(whole),
    )
    assert main([command, str(less)]) == 1
    said = " ".join(capsys.readouterr().out.split())
    assert f"expected {last + 1} messages on /camera/calibration, found {last}: they were counted" in said


def test_what_came_first_is_missed_as_well(tmp_path: Path) -> None:
    less = rewritten(GOLDEN, tmp_path / "a.mcap", lambda topic, number: topic != "/clock" or number > 1)
    assert "2 of the messages on /clock are missing" in content(less).sentence


def test_messages_of_one_number_are_told(tmp_path: Path) -> None:
    path = rewritten(GOLDEN, tmp_path / "a.mcap", everything, number=lambda number: number // 2)
    found = content(path)
    assert found.state == "different"
    assert "27 of the messages on /clock have the number of another one" in found.sentence


def test_what_nothing_tells_is_said(tmp_path: Path) -> None:
    """No number is left out at the end of a topic, and a file of another writer may have none at all."""
    assert "no record of counts, so that what may be missing at a topic's end is not told" in content(GOLDEN).sentence
    copy = rewritten(GOLDEN, tmp_path / "a.mcap", everything, number=lambda _: 0)
    found = content(copy)
    assert found.state == "identical"
    assert "what may be missing in it is not told" in found.sentence
    whole = content(session.record(tmp_path / "whole.mcap"))
    assert (whole.state, "not told" in whole.sentence) == ("identical", False)


def test_numbers_run_on_through_parts_and_a_later_one_alone_begins_anywhere(tmp_path: Path) -> None:
    path = split(tmp_path / "a.mcap")
    assert content(path).state == "identical"
    assert content(files_of(path)[2]).state == "identical"
