"""A file that has got a recording's name while it was recorded stays: what was recorded gets the next free name."""

from __future__ import annotations

import logging
from pathlib import Path

import pytest

from shared.bus import Received
from station.__main__ import main
from station.recording.names import Names
from station.recording.parts import files_of
from station.recording.reader import open_recording
from station.recording.repair import repair
from station.recording.writer import Recording, partial_path
from station.recording.writer_process import WriterProcess, can_start_writer_process
from tests.unit.recording import session
from tests.unit.recording.test_parts import FLUSH_S, SPLIT, contents, split

OTHERS = b"somebody else's recording"


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return session.record(tmp_path_factory.mktemp("whole") / "a.mcap")


def write_all(recording: Recording | WriterProcess) -> Path:
    for receive_ns, topic, message in session.traffic():
        recording.write(Received(topic, receive_ns=receive_ns, message=message))
    return recording.close()


@pytest.mark.parametrize("overwrite", [False, True])
def test_a_name_that_was_taken_meanwhile_is_left_to_its_file(
    tmp_path: Path, whole: Path, caplog: pytest.LogCaptureFixture, *, overwrite: bool
) -> None:
    path = tmp_path / "a.mcap"
    if overwrite:
        session.record(path)
    recording = Recording(path, provenance=session.provenance(), overwrite=overwrite)
    path.write_bytes(OTHERS)
    with caplog.at_level(logging.WARNING):
        found = write_all(recording)
    assert path.read_bytes() == OTHERS
    assert (found, recording.path, recording.stopped) == (tmp_path / "a-2.mcap", tmp_path / "a-2.mcap", "")
    assert contents(found) == contents(whole)
    assert f"what was recorded is in {found}" in caplog.text
    assert {file.name for file in tmp_path.iterdir()} == {"a.mcap", "a-2.mcap"}


def test_the_next_free_name_is_free(tmp_path: Path) -> None:
    for name in ("growing", "a.mcap", "a-2.mcap"):
        (tmp_path / name).write_bytes(name.encode())
    assert Names(tmp_path / "b.mcap").give(tmp_path / "growing", tmp_path / "a.mcap") == tmp_path / "a-3.mcap"
    assert (tmp_path / "a-2.mcap").read_bytes() == b"a-2.mcap"


def test_all_parts_follow_the_first_one(tmp_path: Path, whole: Path) -> None:
    path = tmp_path / "a.mcap"
    recording = Recording(path, provenance=session.provenance(), flush_every_s=FLUSH_S, split_bytes=SPLIT)
    path.write_bytes(OTHERS)
    found = write_all(recording)
    assert found == tmp_path / "a-2.mcap"
    assert len(files_of(found)) > 5
    assert contents(found) == contents(whole)
    assert set(tmp_path.iterdir()) == {path, *files_of(found)}


def test_a_later_part_whose_name_was_taken_is_kept_too(tmp_path: Path, whole: Path) -> None:
    path, taken = tmp_path / "a.mcap", tmp_path / "a.part002.mcap"
    recording = Recording(path, provenance=session.provenance(), flush_every_s=FLUSH_S, split_bytes=SPLIT)
    taken.write_bytes(OTHERS)
    write_all(recording)
    assert taken.read_bytes() == OTHERS
    (tmp_path / "a.part002-2.mcap").replace(taken)
    assert contents(path) == contents(whole)


@pytest.mark.skipif(not can_start_writer_process(), reason="needs Linux and two processors")
def test_a_process_of_its_own_says_where_the_recording_is(tmp_path: Path, whole: Path) -> None:
    path = tmp_path / "a.mcap"
    sink = WriterProcess(Recording(path, provenance=session.provenance()))
    path.write_bytes(OTHERS)
    assert write_all(sink) == sink.path == tmp_path / "a-2.mcap"
    assert contents(sink.path) == contents(whole)


def test_a_repair_takes_no_name_either(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, whole: Path) -> None:
    path = tmp_path / "a.mcap"
    partial_path(path).write_bytes(whole.read_bytes())
    exists = Path.exists

    def taken_after_it_was_looked_at(self: Path) -> bool:
        found = exists(self)
        if self == path:
            self.write_bytes(OTHERS)
        return found

    monkeypatch.setattr(Path, "exists", taken_after_it_was_looked_at)
    done = repair(partial_path(path))
    assert path.read_bytes() == OTHERS
    assert done.path == tmp_path / "a-2.mcap"
    assert contents(done.path) == contents(whole)


def test_a_repaired_part_leaves_its_neighbours(tmp_path: Path) -> None:
    first = split(tmp_path / "a.mcap")
    before = contents(first)
    first.rename(partial_path(first))
    repair(partial_path(first))
    assert contents(first) == before


def test_a_session_sums_up_its_own_recording(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.mcap"
    claimed = Names.__init__

    def taken_then(self: Names, first: Path) -> None:
        claimed(self, first)
        first.write_bytes(OTHERS)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Names, "__init__", taken_then)
        assert main(["run", "--lockstep", "--samples", "1", "--seed", "1", "--out", str(path)]) == 0
    assert "Onset angle by direction" in capsys.readouterr().out
    assert len(open_recording(tmp_path / "a-2.mcap").samples()) == 1
