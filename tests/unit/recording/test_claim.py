"""A name is claimed before anything is opened: nobody's start takes away what another has recorded or still records."""

from __future__ import annotations

import io
import shutil
from pathlib import Path
from typing import Any

import pytest

from shared.errors import UserError
from shared.system import files
from station.recording import claim, disk
from station.recording.claim import Claim, claim_path
from station.recording.parts import files_of
from station.recording.repair import repair, repair_folder
from station.recording.writer import Recording, partial_path
from tests.unit.recording import session
from tests.unit.recording.test_parts import FLUSH_S, SPLIT, contents, split


def write(recording: Recording, part: slice) -> None:
    for receive_ns, topic, message in list(session.traffic())[part]:
        recording.write_message(topic, message, receive_ns=receive_ns)


@pytest.mark.parametrize("split_bytes", [0, SPLIT])
@pytest.mark.parametrize("overwrite", [False, True])
def test_a_second_recorder_leaves_what_is_being_written(tmp_path: Path, split_bytes: int, *, overwrite: bool) -> None:
    """With --overwrite it deleted a live recording's file, or its parts, and was refused afterwards or not at all."""
    path = tmp_path / "a.mcap"
    whole = contents(session.record(tmp_path / "whole.mcap"))
    live = Recording(path, provenance=session.provenance(), flush_every_s=FLUSH_S, split_bytes=split_bytes)
    write(live, slice(0, 600))
    before = sorted(tmp_path.iterdir())
    with pytest.raises(UserError, match="another program is still writing"):
        Recording(path, provenance=session.provenance(), overwrite=overwrite)
    assert sorted(tmp_path.iterdir()) == before
    write(live, slice(600, None))
    live.close()
    assert live.stopped == ""
    assert contents(path) == whole


@pytest.mark.parametrize("number", [1, 2])
def test_a_part_of_a_live_recording_is_no_name_for_another(tmp_path: Path, number: int) -> None:
    with (
        Recording(tmp_path / "a.mcap", provenance=session.provenance()),
        pytest.raises(UserError, match="still writing"),
    ):
        Recording(tmp_path / f"a.part{number:03d}.mcap", provenance=session.provenance(), overwrite=True)


def test_a_start_that_fails_leaves_the_recording_that_it_would_replace(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = split(tmp_path / "a.mcap")
    partial_path(path).write_bytes(b"what broke off")
    before = {file: file.read_bytes() for file in tmp_path.iterdir()}

    def no_room(_file: io.FileIO, _size: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(disk, "occupy", no_room)
    with pytest.raises(UserError, match="MB of room"):
        Recording(path, provenance=session.provenance(), overwrite=True)
    assert {file: file.read_bytes() for file in tmp_path.iterdir()} == before


def test_what_is_replaced_stays_until_the_new_recording_has_its_name(tmp_path: Path) -> None:
    path = split(tmp_path / "a.mcap")
    old = contents(path)
    recording = Recording(path, provenance=session.provenance(), overwrite=True)
    write(recording, slice(0, 100))
    assert contents(path) == old
    recording.let_go()  # as if the process had been killed
    assert contents(path) == old
    partial_path(path).unlink()
    session.record(path, overwrite=True)
    assert files_of(path) == [path]


def test_a_new_recording_in_parts_replaces_an_old_one(tmp_path: Path) -> None:
    path, again = split(tmp_path / "a.mcap"), split(tmp_path / "again" / "a.mcap")
    shutil.copy(files_of(path)[-1], tmp_path / "a.part099.mcap")
    partial_path(tmp_path / "a.part002.mcap").write_bytes(b"an older part that broke off")
    split(path, overwrite=True)
    assert contents(path) == contents(again)
    assert sorted(file.name for file in tmp_path.glob("a.*")) == [file.name for file in files_of(again)]


def test_whoever_comes_between_opening_and_locking_has_the_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The file that was opened is gone by then, and its lock is worth nothing."""
    first = Claim(tmp_path / "a.mcap")
    locks = list[io.FileIO]()

    def lock(file: io.FileIO) -> None:
        locks.append(file)
        if len(locks) == 1:
            first.release()
        files.lock(file)

    monkeypatch.setattr(claim, "lock", lock)
    with Claim(tmp_path / "a.mcap"):
        assert len(locks) == 2
        with pytest.raises(UserError, match="still writing"):
            Claim(tmp_path / "a.mcap")
    assert list(tmp_path.iterdir()) == []


def test_a_claim_of_a_process_that_is_gone_binds_nobody(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    claim_path(path).write_bytes(b"")
    session.record(path)
    assert [file.name for file in tmp_path.iterdir()] == ["a.mcap"]


def test_nobody_repairs_to_a_name_that_a_session_has(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    recording = Recording(path, provenance=session.provenance())
    write(recording, slice(0, 100))
    left = partial_path(tmp_path / "a.part007.mcap")
    shutil.copy(session.record(tmp_path / "b.mcap"), left)
    assert repair_folder(tmp_path) == ()
    with pytest.raises(UserError, match="still writing"):
        repair(left)
    recording.close()
    assert [done.source for done in repair_folder(tmp_path)] == [left]


def test_a_folder_in_which_nothing_can_be_locked_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_locks(_file: Any) -> None:
        raise OSError(37, "No locks available")

    monkeypatch.setattr(claim, "lock", no_locks)
    with pytest.raises(UserError, match="No locks available"):
        Recording(tmp_path / "a.mcap", provenance=session.provenance())
