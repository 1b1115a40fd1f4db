"""Messages come by log time, also where chunks overlap."""

from __future__ import annotations

from pathlib import Path

from shared.messages import MarkerCorners
from station.recording.reader import open_recording
from station.recording.writer import Recording
from tests.unit.recording import session


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
