"""Reading gives back what was written, keeps the truth to itself, and says in one sentence what is wrong."""

from __future__ import annotations

from pathlib import Path

import pytest

from shared.errors import UserError
from shared.messages import MarkerCorners, Sample
from station.recording.reader import digest, open_recording
from station.recording.repair import copy_without
from station.recording.writer import Recording, partial_path
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


def test_late_messages_are_put_in_order_across_chunks(tmp_path: Path) -> None:
    path = tmp_path / "late.mcap"
    times = [10, 20, 5, 40, 30, 30, 25, 60, 50, 31]
    with Recording(path, provenance=session.provenance()) as recording:
        for seq, ms in enumerate(times):
            message = MarkerCorners(seq=seq, capture_ns=session.START_NS)
            recording.write_message("camera/corners", message, receive_ns=session.START_NS + ms * 1_000_000)
            if seq % 3 == 2:
                recording.flush()
    found = [item.message for item in open_recording(path).messages()]
    order = sorted(range(len(times)), key=lambda seq: times[seq])
    assert [message.seq for message in found if isinstance(message, MarkerCorners)] == order


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


def test_the_digest_knows_every_byte(path: Path, tmp_path: Path) -> None:
    again = session.record(tmp_path / "b.mcap")
    assert digest(open_recording(path)) == digest(open_recording(again))
    with Recording(tmp_path / "c.mcap", provenance=session.provenance()) as recording:
        for receive_ns, topic, message in session.traffic():
            changed = Sample(run=99) if isinstance(message, Sample) else message
            recording.write_message(topic, changed, receive_ns=receive_ns)
    assert digest(open_recording(tmp_path / "c.mcap")) != digest(open_recording(path))


@pytest.mark.parametrize(
    ("content", "words"),
    [(b"", "is empty"), (b"hello, this is no recording" * 9, "another kind"), (b"\x89MCAP0\r\n", "breaks off")],
)
def test_bad_files_are_named(content: bytes, words: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.mcap"
    path.write_bytes(content)
    with pytest.raises(UserError, match=words):
        open_recording(path)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="cannot be read"):
        open_recording(tmp_path / "none.mcap")


def test_a_partial_file_asks_for_repair(path: Path) -> None:
    path.rename(partial_path(path))
    with pytest.raises(UserError, match="station repair"):
        open_recording(partial_path(path))


def read_everything(path: Path) -> object:
    reader = open_recording(path)
    rows = [(item.log_ns, item.publish_ns, item.topic, item.payload) for item in reader.messages(truth=True)]
    return rows, reader.metadata["session"], reader.attachments


def test_cut_off_anywhere_gives_one_sentence(path: Path, tmp_path: Path) -> None:
    content = path.read_bytes()
    cut = tmp_path / "cut.mcap"
    for size in range(1, len(content), len(content) // 150):
        cut.write_bytes(content[:size])
        with pytest.raises(UserError):
            read_everything(cut)


def test_a_flipped_byte_never_goes_unnoticed_as_other_data(path: Path, tmp_path: Path) -> None:
    content = path.read_bytes()
    expected = read_everything(path)
    bad = tmp_path / "bad.mcap"
    noticed = 0
    for place in range(0, len(content), len(content) // 300):
        bad.write_bytes(content[:place] + bytes([content[place] ^ 0x41]) + content[place + 1 :])
        try:
            found = read_everything(bad)
        except UserError:
            noticed += 1
        else:
            # The message indexes between the chunks are not read by us, so a flip there does no harm.
            assert found == expected, f"byte {place} changed what was read"
    assert noticed > 100
