"""A recording in several files: each a whole one, nothing lost or doubled where they meet, read as one by everybody."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from shared.bus import Received
from shared.errors import UserError
from station.__main__ import main
from station.app.signature import file_sha256
from station.recording.arrays import run_signals
from station.recording.counts import METADATA as COUNTS
from station.recording.parts import files_of, sha256_of
from station.recording.provenance import Provenance
from station.recording.reader import RecordingReader, digest, open_recording
from station.recording.repair import repair, repair_folder
from station.recording.writer import Recording, partial_path
from station.recording.writer_process import WriterProcess
from tests.unit.app.forging import forged
from tests.unit.recording import session
from tests.unit.recording.test_counts import without_one

GOLDEN = Path(__file__).parents[2] / "golden" / "session.mcap"
SPLIT = 20_000
FLUSH_S = 0.02
"""Small enough for a dozen parts of a session of four seconds."""


def split(path: Path, *, apart: bool = False, overwrite: bool = False) -> Path:
    recording = Recording(
        path, provenance=session.provenance(), flush_every_s=FLUSH_S, split_bytes=SPLIT, overwrite=overwrite
    )
    with WriterProcess(recording) if apart else recording as sink:
        for receive_ns, topic, message in session.traffic():
            sink.write(Received(topic, receive_ns=receive_ns, message=message))
    return path


@pytest.fixture(scope="module")
def parted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return split(tmp_path_factory.mktemp("parted") / "a.mcap")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return session.record(tmp_path_factory.mktemp("whole") / "a.mcap")


def contents(path: Path) -> list[tuple[str, int, int, bytes]]:
    items = open_recording(path).messages(truth=True)
    return [(item.topic, item.publish_ns, item.log_ns, item.payload) for item in items]


def test_every_message_is_there_once_and_in_order(parted: Path, whole: Path) -> None:
    assert len(files_of(parted)) > 5
    assert contents(parted) == contents(whole)
    assert digest(open_recording(parted)) == digest(open_recording(whole))


def test_whatever_is_read_is_that_of_one_file(parted: Path, whole: Path) -> None:
    one, other = open_recording(parted), open_recording(whole)
    ours = {name: info for name, info in one.topics.items() if info.message}
    assert ours == {name: info for name, info in other.topics.items() if info.message}
    assert one.samples() == other.samples()
    assert (one.start_ns, one.end_ns, one.attachments) == (other.start_ns, other.end_ns, other.attachments)
    assert described(one) == described(other)
    assert run_signals_equal(one, other)
    middle = (one.start_ns + one.end_ns) // 2
    spans = [[item.log_ns for item in reader.messages(from_ns=middle)] for reader in (one, other)]
    assert spans[0] == spans[1]


def described(reader: RecordingReader) -> dict[str, dict[str, str]]:
    """The metadata without what each file has of its own."""
    return {name: record for name, record in reader.metadata.items() if name not in ("part", COUNTS)}


def run_signals_equal(one: RecordingReader, other: RecordingReader) -> bool:
    ours, theirs = ([signals for _, signals in run_signals(reader)] for reader in (one, other))
    assert len(ours) == 2
    return all(np.array_equal(a.corners.time_ns, b.corners.time_ns) for a, b in zip(ours, theirs, strict=True))


def test_sequence_numbers_run_on_across_the_seams(parted: Path) -> None:
    numbers = list[int]()
    for path in files_of(parted):
        with path.open("rb") as file:
            for _, channel, message in make_reader(file).iter_messages(topics=["/camera/corners"]):
                assert channel.topic == "/camera/corners"
                numbers.append(message.sequence)
    assert len(numbers) == open_recording(parted).topics["camera/corners"].count
    assert numbers == list(range(len(numbers)))


def test_each_part_is_a_whole_recording(parted: Path) -> None:
    for number, path in enumerate(files_of(parted)[1:], start=2):
        reader = open_recording(path)
        assert reader.metadata["part"]["number"] == str(number)
        assert reader.attachments["rig.toml"] == b'id = "bench"\n'
        assert sum(1 for _ in reader.messages())


def test_a_process_of_its_own_writes_the_same_parts(parted: Path, tmp_path: Path) -> None:
    writer_process = split(tmp_path / "a.mcap", apart=True)
    assert [path.read_bytes() for path in files_of(writer_process)] == [path.read_bytes() for path in files_of(parted)]


def copy(parted: Path, folder: Path) -> Path:
    for path in files_of(parted):
        shutil.copy(path, folder / path.name)
    return folder / parted.name


def test_a_missing_part_is_told_and_the_others_are_read(parted: Path, tmp_path: Path) -> None:
    first = copy(parted, tmp_path)
    files_of(first)[-1].unlink()
    reader = open_recording(first)
    assert "which is not beside it" in reader.missing
    assert 0 < sum(1 for _ in reader.messages()) < sum(1 for _ in open_recording(parted).messages())


def test_the_doctor_names_a_missing_part(parted: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    first = copy(parted, tmp_path)
    files_of(first)[1].rename(tmp_path / "aside")
    main(["doctor", str(first), "--json"])
    assert "a.part002.mcap" in json.dumps(json.loads(capsys.readouterr().out))


@pytest.mark.parametrize("command", ["check", "verify"])
def test_a_recording_of_which_a_part_is_missing_is_not_all_the_same(
    tmp_path: Path, command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """They said so on the terminal's other channel alone, beside "identical"."""
    first = tmp_path / "a.mcap"
    with Recording(first, provenance=golden_provenance(), flush_every_s=FLUSH_S, split_bytes=500_000) as recording:
        for item in open_recording(GOLDEN).messages():
            recording.write_message(item.topic, item.message, receive_ns=item.log_ns)
    assert main([command, str(first)]) == 0
    files_of(first)[-1].unlink()
    assert main([command, str(first)]) == 1
    assert "which is not beside it" in capsys.readouterr().out


def golden_provenance() -> Provenance:
    files = open_recording(GOLDEN).attachments
    texts = {"rig_toml": files["rig.toml"].decode(), "plan_toml": files["plan.toml"].decode()}
    return session.provenance(rig_id="simulated", seed=123, **texts)


def test_messages_that_a_part_has_lost_are_told_with_its_name(parted: Path, tmp_path: Path) -> None:
    first = copy(parted, tmp_path)
    assert open_recording(first).miscounted == ()
    forged(files_of(parted)[1], files_of(first)[1], without_one("camera/corners"))
    (sentence,) = open_recording(first).miscounted
    assert sentence.startswith("a.part002.mcap: expected ")
    assert "messages on /camera/corners, found" in sentence


def test_a_part_read_alone_has_counts_of_its_own(parted: Path) -> None:
    assert [open_recording(path).miscounted for path in files_of(parted)[1:]] == [()] * (len(files_of(parted)) - 1)


def test_a_file_of_another_session_is_no_part(parted: Path, tmp_path: Path) -> None:
    first, part = copy(parted, tmp_path), tmp_path / "a.part002.mcap"
    shutil.copy(files_of(first)[2], part)
    with pytest.raises(UserError, match="to be part 2 of the session"):
        open_recording(first)


def test_a_seam_at_which_messages_are_missing_is_told(parted: Path, tmp_path: Path) -> None:
    first = copy(parted, tmp_path)
    saved = repair(first, out=tmp_path / "b.mcap")
    assert saved.findings.messages
    assert not open_recording(first).seams
    shorter = tmp_path / "a.part002.mcap"
    with Recording(tmp_path / "c.mcap", provenance=session.provenance()) as recording:
        recording.add_metadata("part", open_recording(shorter).metadata["part"])
    (tmp_path / "c.mcap").replace(shorter)
    assert "a.part003.mcap" in open_recording(first).seams[0]


def test_a_part_that_broke_off_is_repaired_and_read(tmp_path: Path, whole: Path) -> None:
    path, items = tmp_path / "a.mcap", list(session.traffic())
    recording = Recording(path, provenance=session.provenance(), flush_every_s=FLUSH_S, split_bytes=SPLIT)
    for receive_ns, topic, message in items:
        recording.write(Received(topic, receive_ns=receive_ns, message=message))
    recording.flush()
    recording.let_go()  # as if the process had been killed: nothing more is written, and the lock is gone
    broken = partial_path(files_of(path)[-1].with_name(f"a.part{len(files_of(path)) + 1:03d}.mcap"))
    with pytest.raises(UserError, match="station repair"):
        open_recording(path)
    assert [done.source for done in repair_folder(tmp_path)] == [broken]
    assert contents(path) == contents(whole)


def test_a_new_session_never_takes_an_old_part_for_its_own(parted: Path, tmp_path: Path) -> None:
    first = copy(parted, tmp_path)
    first.unlink()
    with pytest.raises(UserError, match=r"a\.part002\.mcap exists"):
        Recording(first, provenance=session.provenance())
    session.record(first, overwrite=True)
    assert files_of(first) == [first]


def test_where_no_next_part_can_be_begun_the_last_one_grows_on(tmp_path: Path, whole: Path) -> None:
    path = tmp_path / "a.mcap"
    recording = Recording(path, provenance=session.provenance(), flush_every_s=FLUSH_S, split_bytes=SPLIT)
    partial_path(tmp_path / "a.part002.mcap").mkdir()
    with recording:
        for receive_ns, topic, message in session.traffic():
            recording.write(Received(topic, receive_ns=receive_ns, message=message))
    assert files_of(path) == [path]
    assert contents(path) == contents(whole)


def test_the_digest_of_the_content_is_that_of_all_parts(parted: Path, tmp_path: Path) -> None:
    first = copy(parted, tmp_path)
    assert file_sha256(first) == sha256_of(parted)
    last = files_of(first)[-1]
    last.write_bytes(last.read_bytes()[:-1] + b"x")
    assert file_sha256(first) != sha256_of(parted)


@pytest.mark.parametrize("named", ["all", "folder"])
def test_the_parts_of_a_session_are_one_recording(
    parted: Path, named: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first = copy(parted, tmp_path)
    words = [str(path) for path in files_of(first)] if named == "all" else [str(tmp_path)]
    assert main(["samples", *words, "--json"]) == 0
    (row,) = json.loads(capsys.readouterr().out)
    assert row["runs"] == 2
