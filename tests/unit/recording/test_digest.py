"""The digest of a recording is that of what was measured, to the byte."""

from __future__ import annotations

from pathlib import Path

from shared.messages import Sample
from station.recording.reader import digest, open_recording
from station.recording.writer import Recording
from tests.unit.recording import session


def test_the_digest_knows_every_byte(tmp_path: Path) -> None:
    path = session.record(tmp_path / "a.mcap")
    again = session.record(tmp_path / "b.mcap")
    assert digest(open_recording(path)) == digest(open_recording(again))
    with Recording(tmp_path / "c.mcap", provenance=session.provenance()) as recording:
        for receive_ns, topic, message in session.traffic():
            changed = Sample(run=99) if isinstance(message, Sample) else message
            recording.write_message(topic, changed, receive_ns=receive_ns)
    assert digest(open_recording(tmp_path / "c.mcap")) != digest(open_recording(path))
