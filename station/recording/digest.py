"""The digest of what a recording measured."""

from __future__ import annotations

import hashlib

from station.recording.file_reader import RecordingReader


def digest(reader: RecordingReader) -> str:
    """Returns the SHA-256 of every measured message: topic, capture time and bytes, in order.

    Two sessions of one seed in simulated time have the same. Metadata (versions, file names) and the truth are not in
    it; nor are log times, which in a live session are never twice the same.
    """
    total = hashlib.sha256()
    for item in reader.messages():
        total.update(f"{item.topic} {item.publish_ns} {len(item.payload)}\n".encode())
        total.update(item.payload)
    return total.hexdigest()
