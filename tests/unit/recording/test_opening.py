"""A file that is no finished recording is refused when it is opened, in one sentence; a damaged one when it is read."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from shared.errors import UserError
from station.__main__ import main
from station.recording.reader import open_recording
from station.recording.writer import partial_path
from tests.unit.recording import session


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return session.record(tmp_path / "a.mcap")


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


@pytest.mark.parametrize("command", ["samples", "doctor", "verify"])
def test_a_pipe_is_refused_and_not_waited_for(tmp_path: Path, command: str, capsys: pytest.CaptureFixture[str]) -> None:
    """A named pipe to which nobody writes was waited for without end."""
    pipe = tmp_path / "a.mcap"
    os.mkfifo(pipe)
    writer = os.open(pipe, os.O_RDWR | os.O_NONBLOCK)  # a reader that waits would find nothing, and go on waiting
    try:
        assert main([command, str(pipe)]) == 2
    finally:
        os.close(writer)
    assert "is a pipe or a device" in capsys.readouterr().err
