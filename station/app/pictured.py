"""A picture of one moment of a recording, drawn from what is needed for it: seconds, however long the session is."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from heapq import merge
from pathlib import Path

from station.recording.reader import TRUTH, Recorded, RecordingReader
from station.view import viewer
from station.view.rrd import write_rrd
from station.view.setup import Setup

_BEFORE_S, _AFTER_S = 40.0, 5.0
"""The stretch of frequent topics that a picture shows: a run takes some 13 s, so the curves begin one run earlier."""

_FREQUENT_HZ = 5.0
"""A picture shows what is near its moment of topics that come oftener, and the whole session of the others."""

_AFTER_SLIP_S = 0.2


def write_picture(reader: RecordingReader, out: Path, *, setup: Setup, at_s: float | None) -> list[str]:
    """Draws the moment `at_s` seconds after the recording's begin (None: just after the last slip) into a PNG.

    Returns:
        What the viewer's panels complained of.

    Raises:
        UserError: if it cannot be drawn here, or `out` cannot be written.
    """
    at_ns = telling_ns(reader) if at_s is None else reader.start_ns + round(at_s * 1e9)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "moment.rrd"
        items = ((item.topic, item.message, item.publish_ns) for item in near(reader, at_ns))
        start_ns, name = reader.start_ns, reader.path.stem
        write_rrd(items, path, topics=reader.topics, setup=setup, name=name, start_ns=start_ns)
        return viewer.screenshot(path, out, at_s=(at_ns - start_ns) * 1e-9)


def telling_ns(reader: RecordingReader) -> int:
    """Returns the moment just after the last slip, when a picture tells most; the end without one."""
    slips = [sample.detect_ns for sample in reader.samples() if not sample.censored and sample.detect_ns]
    return slips[-1] + round(_AFTER_SLIP_S * 1e9) if slips else reader.end_ns


def near(reader: RecordingReader, at_ns: int) -> Iterator[Recorded]:
    """Returns the messages for a picture of the moment `at_ns`, by log time.

    Of frequent topics there are those near it, of all others every one.
    """
    shown = {name: info.count for name, info in reader.topics.items() if not name.startswith(TRUTH)}
    frequent = {name for name, count in shown.items() if count > _FREQUENT_HZ * reader.duration_s}
    often = reader.messages(frequent, at_ns - round(_BEFORE_S * 1e9), at_ns + round(_AFTER_S * 1e9))
    return merge(reader.messages(shown.keys() - frequent), often, key=lambda item: item.log_ns)
