"""A repair saves everything that can be read, and touches nothing that is still being written."""

from __future__ import annotations

from pathlib import Path

import pytest

from shared.errors import UserError
from station.recording.disk import reserve_path
from station.recording.reader import open_recording
from station.recording.repair import repair, repair_folder
from station.recording.writer import Recording, partial_path
from tests.unit.recording import session


def rows(path: Path) -> list[tuple[int, int, str, bytes]]:
    return [
        (item.log_ns, item.publish_ns, item.topic, item.payload) for item in open_recording(path).messages(truth=True)
    ]


def leave_partial(path: Path, *, size: int | None = None) -> None:
    """Leaves what a killed session leaves: the file of a finished one, cut."""
    content = session.record(path).read_bytes()
    path.unlink()
    partial_path(path).write_bytes(content[:size])


def test_a_whole_file_is_saved_whole(tmp_path: Path) -> None:
    expected = rows(session.record(tmp_path / "b.mcap"))
    leave_partial(tmp_path / "a.mcap")
    done = repair(partial_path(tmp_path / "a.mcap"))
    assert done.path == tmp_path / "a.mcap"
    assert not partial_path(done.path).exists()
    assert rows(done.path) == expected
    reader = open_recording(done.path)
    assert reader.attachments == open_recording(tmp_path / "b.mcap").attachments
    assert reader.metadata["session"] == open_recording(tmp_path / "b.mcap").metadata["session"]
    assert reader.metadata["repair"]["lost_bytes"] == "0"


def test_cut_anywhere_every_whole_chunk_is_saved(tmp_path: Path) -> None:
    full = session.record(tmp_path / "b.mcap")
    expected, size = rows(full), full.stat().st_size
    before = -1
    for number, cut in enumerate(range(2000, size, size // 40)):
        path = tmp_path / f"a{number}.mcap"
        leave_partial(path, size=cut)
        found = rows(repair(partial_path(path)).path)
        assert found == expected[: len(found)]
        assert len(found) >= before
        before = len(found)
    assert before > 0.8 * len(expected)


def test_a_damaged_chunk_costs_only_its_own_messages(tmp_path: Path) -> None:
    path = session.record(tmp_path / "a.mcap")
    expected = rows(path)
    content = bytearray(path.read_bytes())
    content[len(content) // 3] ^= 0xFF
    content[1500] ^= 0xFF  # the first chunk, which defines the topics: the summary names them once more
    path.write_bytes(content)
    with pytest.raises(UserError, match="damaged"):
        rows(path)
    done = repair(path)
    assert done.path == tmp_path / "a.repaired.mcap"
    assert path.exists()
    assert done.findings.bad_records >= 1
    assert done.findings.unknown_messages == 0
    saved = rows(done.path)
    assert set(saved) < set(expected)
    assert len(saved) > 0.6 * len(expected)


@pytest.mark.parametrize("content", [b"", b"not at all", b"\x89MCAP0\r"])
def test_nothing_readable_is_said_and_nothing_is_touched(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "a.mcap.partial"
    path.write_bytes(content)
    with pytest.raises(UserError, match="another kind of file"):
        repair(path)
    assert [item.name for item in tmp_path.iterdir()] == [path.name]


def test_an_existing_name_is_not_overwritten(tmp_path: Path) -> None:
    leave_partial(tmp_path / "a.mcap")
    session.record(tmp_path / "c.mcap").rename(tmp_path / "a.mcap")
    with pytest.raises(UserError, match="--out"):
        repair(partial_path(tmp_path / "a.mcap"))
    repair(partial_path(tmp_path / "a.mcap"), out=tmp_path / "d.mcap")
    assert partial_path(tmp_path / "a.mcap").exists()


def test_the_next_start_repairs_what_nobody_writes(tmp_path: Path) -> None:
    leave_partial(tmp_path / "a.mcap")
    reserve_path(partial_path(tmp_path / "a.mcap")).write_bytes(b"")
    (tmp_path / "junk.mcap.partial").write_bytes(b"junk")
    with Recording(tmp_path / "live.mcap", provenance=session.provenance()):
        with pytest.raises(UserError, match="still writing"):
            repair(partial_path(tmp_path / "live.mcap"))
        assert [done.path.name for done in repair_folder(tmp_path)] == ["a.mcap"]
        assert partial_path(tmp_path / "live.mcap").exists()
    assert sorted(item.name for item in tmp_path.iterdir()) == ["a.mcap", "junk.mcap.partial", "live.mcap"]
