"""Compares the files with what they say of themselves: their parts, their counts, and the metadata.

These have checksums, and say of the session what the attached rig file and plan do.
"""

from __future__ import annotations

from itertools import chain

from shared.errors import UserError
from station.app.described_otherwise import Otherwise, described_otherwise
from station.app.verified.part import Mismatch, Part
from station.recording.counts import METADATA as COUNTS
from station.recording.lost import lost
from station.recording.malformed import left_out
from station.recording.numbered import Numbered, numbered
from station.recording.reader import RecordingReader


def part(reader: RecordingReader) -> Part:
    """Returns the part `content`, for which everything is read.

    Raises:
        UserError: if a chunk or an attachment does not match its checksum.
    """
    by_number = numbered(reader)
    count, changed, others = by_number.count, reader.changed_metadata, _otherwise(reader)
    gone = lost(reader, by_number)
    faults = {"part": gone.parts, COUNTS: gone.miscounted, "sequence": gone.misnumbered}
    said = list(chain.from_iterable(faults.values()))
    if changed:
        said.append(f"metadata {', '.join(map(repr, changed))} is not as it was written")
    said += map(str, others)
    if said:
        name = next(iter([*changed, *(one for one, found in faults.items() if found)]), "")
        line = (others[0].line, others[0].said, others[0].attached) if others else (name, "", "")
        where = Mismatch("metadata", reader.start_ns, *line)
        return Part("content", "different", count, _with_left_out("; ".join(said), reader), where)
    attached = len(reader.attachments)
    words = f"{count} messages and {attached} attached files match their checksums{_untold(reader, by_number)}"
    return Part("content", "identical", count, _with_left_out(words, reader))


def _untold(reader: RecordingReader, by_number: Numbered) -> str:
    """Returns what nothing in the file would tell of missing messages."""
    if COUNTS in reader.metadata:
        return ""
    where = "in it" if by_number.nothing_numbered else "at a topic's end"
    return f"; it has no record of counts, so that what may be missing {where} is not told"


def _otherwise(reader: RecordingReader) -> list[Otherwise]:
    try:
        return list(described_otherwise(reader))
    except UserError:  # the attached file is no TOML, which the parts that need it say
        return []


def _with_left_out(words: str, reader: RecordingReader) -> str:
    return f"{words}. {left_out(reader.malformed)}".removesuffix(". ")
