"""Opens recordings: looks at both ends and the index of a file before anything in it is believed, and at its parts."""

from __future__ import annotations

import logging
import stat
from pathlib import Path
from typing import BinaryIO

from mcap.summary import Summary

from shared.errors import UserError
from shared.visible import visible
from station.recording.bounded import BROKEN, require_unpacked_within
from station.recording.chunks import DamageError
from station.recording.file_reader import RecordingReader
from station.recording.index import FOOTER_BYTES, read_index
from station.recording.index_entries import named
from station.recording.indexed import damaged
from station.recording.mcap_file import MAGIC
from station.recording.parted import PartedReader, continued_in
from station.recording.parts import number_of, part_path
from station.recording.writer import PARTIAL

_LOG = logging.getLogger(__name__)


def open_recording(path: Path) -> RecordingReader:
    """Opens a finished recording, with the parts in which it goes on; a later part alone, if that is named.

    Raises:
        UserError: in one sentence, if there is none, or it is empty, cut off, damaged or something else.
    """
    path = Path(path)
    first = open_file(path)
    parts, missing = [first], ""
    while number_of(path.name) == 1 and (name := continued_in(parts[-1])) and not missing:
        after = part_path(path, len(parts) + 1)
        if after.exists():
            parts.append(open_file(after))
        elif (broken := after.with_name(after.name + PARTIAL)).exists():
            raise UserError(f"Expected a finished recording, but {broken} breaks off; run: station repair {broken}")
        else:
            missing = f"{path} goes on in {after.name} (written as {visible(name)}), which is not beside it"
            _LOG.warning("%s: what is in it is left out", missing)
    return PartedReader(parts, missing=missing) if len(parts) > 1 or missing else first


def open_file(path: Path) -> RecordingReader:
    """Opens one finished file alone, whether it goes on in another or not.

    Raises:
        UserError: as `open_recording` does.
    """
    try:
        _require_seekable(path)
        with path.open("rb") as file:
            _check_ends(file, path)
            summary = read_index(file)
            _require_bounded(file, summary)
    except OSError as error:
        raise UserError(f"Expected a recording at {path}, but it cannot be read: {error.strerror}") from error
    except BROKEN as error:
        raise damaged(path, str(error) or type(error).__name__) from error
    if summary is None or not _names_all(summary):
        raise UserError(
            f"Expected a recording with an index of its messages and topics, but {path} has none; "
            f"run: station repair {path}"
        )
    return RecordingReader(path, summary)


def _require_seekable(path: Path) -> None:
    """Refuses what is read from its beginning alone; a pipe that nobody writes to would be waited for without end."""
    if not (stat.S_ISREG(mode := path.stat().st_mode) or stat.S_ISDIR(mode)):
        raise UserError(f"Expected a recording at {path}, but it is a pipe or a device; copy it into a file")


def _names_all(summary: Summary) -> bool:
    """Returns false for an index by which messages would silently be none.

    Such messages are outside of chunks, or of a topic that the index omits.

    Other writers may leave out of it what chunks hold as well: topics and their schemas.
    """
    counted, channels = summary.statistics, summary.channels
    if counted is None or (counted.message_count and not (summary.chunk_indexes and channels)):
        return False
    held = {number for number, count in counted.channel_message_counts.items() if count}
    held.update(*(index.message_index_offsets for index in summary.chunk_indexes))
    return held <= channels.keys() and {channel.schema_id for channel in channels.values()} <= {0, *summary.schemas}


def _require_bounded(file: BinaryIO, summary: Summary | None) -> None:
    """Refuses an index by which a small file would hold any amount: packed too well, or read again and again."""
    if summary is None:
        return
    require_unpacked_within(summary.chunk_indexes, file_bytes=file.seek(0, 2))
    end = 0
    for entry in named(summary):
        if entry.offset < end:
            raise DamageError(f"its records overlap (at byte {entry.offset})")
        end = entry.offset + entry.length


def _check_ends(file: BinaryIO, path: Path) -> None:
    start = file.read(len(MAGIC))
    if not start:
        raise UserError(f"Expected a recording, but {path} is empty")
    if start != MAGIC:
        raise UserError(f"Expected a recording (MCAP), but {path} is another kind of file")
    size = file.seek(0, 2)
    file.seek(max(0, size - len(MAGIC)))
    if size < 2 * len(MAGIC) + FOOTER_BYTES or file.read() != MAGIC or path.suffix == PARTIAL:
        raise UserError(
            f"Expected a finished recording, but {path} breaks off before its end; run: station repair {path}"
        )
