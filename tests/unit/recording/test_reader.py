"""Reading gives back what was written, and keeps the truth to itself."""

from __future__ import annotations

from pathlib import Path

import pytest

from shared.errors import UserError
from shared.messages import MarkerCorners
from station.recording.reader import digest, open_recording
from station.recording.repair import copy_without
from tests.unit.recording import session


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return session.record(tmp_path / "a.mcap")


def test_every_message_comes_back_in_order(path: Path) -> None:
    expected = list(session.traffic())
    found = list(open_recording(path).messages(truth=True))
    assert [(item.log_ns, item.topic, item.message) for item in found] == expected


def test_messages_of_some_topics_and_times(path: Path) -> None:
    low, high = session.START_NS + 500_000_000, session.START_NS + 1_000_000_000
    found = list(open_recording(path).messages({"/camera/corners", "arm/command"}, low, high))
    expected = [
        message
        for receive_ns, topic, message in session.traffic()
        if topic in ("camera/corners", "arm/command") and low <= receive_ns < high
    ]
    assert [item.message for item in found] == expected
    assert any(not isinstance(message, MarkerCorners) for message in expected)


def test_metadata_attachments_and_samples(path: Path) -> None:
    reader = open_recording(path)
    assert reader.metadata["session"]["seed"] == "7"
    assert "python" in reader.metadata["versions"]
    assert reader.attachments == {"rig.toml": b'id = "bench"\n', "plan.toml": b"samples = 2\n", "note.txt": b"by hand"}
    assert [sample.censored for sample in reader.samples()] == [False, True]
    assert reader.topics["camera/corners"].count == 360


def test_the_truth_is_handed_out_only_when_asked_for(path: Path) -> None:
    reader = open_recording(path)
    assert not any(item.topic.startswith("truth/") for item in reader.messages())
    with pytest.raises(UserError, match="truth"):
        next(reader.messages({"truth/scene"}))
    assert any(reader.messages({"truth/scene"}, truth=True))


def test_stripping_the_truth_changes_no_answer(path: Path, tmp_path: Path) -> None:
    stripped = tmp_path / "stripped.mcap"
    copy_without(path, stripped, drop=lambda topic: topic.startswith("truth/"))
    with_truth, without = open_recording(path), open_recording(stripped)
    assert "truth/scene" in with_truth.topics
    assert "truth/scene" not in without.topics
    assert digest(with_truth) == digest(without)
    assert [item.message for item in with_truth.messages()] == [item.message for item in without.messages()]
