"""Writes a session as a Rerun file with its layout inside: what `station replay` opens."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from pathlib import Path

import rerun as rr

from shared.errors import UserError
from shared.messages import Message
from station.view.layout import layout
from station.view.overlay import Overlay, draw_overlay
from station.view.part import Rates
from station.view.scene import SceneLogger
from station.view.setup import Setup

APPLICATION = "repose"
_GATHER_S = 5.0
"""Larger pieces load faster; 2 MiB of images end one in any case."""


@dataclass(frozen=True, kw_only=True)
class Drawn:
    """The number of messages, the beginning of the timeline `elapsed`, and what made no sense, by topic."""

    count: int
    start_ns: int
    refused: dict[str, int]


def new_recording(*, gather_s: float = 0.2) -> rr.RecordingStream:
    """Gives a recording whose only clock is the messages' own; what is logged is gathered for `gather_s`, then sent."""
    batches = rr.ChunkBatcherConfig(flush_tick=gather_s)
    recording = rr.RecordingStream(APPLICATION, batcher_config=batches)
    recording.set_log_time_enabled(False)
    recording.set_log_tick_enabled(False)
    return recording


def write_rrd(
    items: Iterable[tuple[str, Message, int]],
    path: Path,
    *,
    topics: Collection[str],
    setup: Setup,
    name: str,
    rates: Rates | None = None,
    overlay: Overlay | None = None,
    start_ns: int | None = None,
) -> Drawn:
    """Draws (topic, message, publish time in ns) into the file `path` as they come.

    `topics` decide the layout. Memory does not grow with the length of the session. `overlay` is drawn over it.
    The timeline `elapsed` begins at `start_ns`, or with the first message.

    Raises:
        UserError: if the file cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.open("wb").close()
    except OSError as error:
        raise UserError(
            f"Expected to write the view to {path}, but it cannot be written ({error.strerror}); "
            "name another place with --save FILE.rrd"
        ) from error
    recording = new_recording(gather_s=_GATHER_S)
    recording.set_sinks(rr.FileSink(path))
    # Active, not only default: the viewer keeps the last layout of an application and would show this one's camera.
    recording.send_blueprint(
        layout(topics, setup=setup, diagnosed=overlay is not None), make_active=True, make_default=True
    )
    recording.send_recording_name(name)
    logger = SceneLogger(recording, setup=setup, rates=rates, start_ns=start_ns)
    count = 0
    for topic, message, publish_ns in items:
        logger.log(topic, message, publish_ns)
        count += 1
    logger.flush()
    if overlay is not None:
        draw_overlay(recording, overlay, setup=setup, start_ns=logger.start_ns)
    recording.flush(timeout_sec=60.0)
    recording.disconnect()
    return Drawn(count=count, start_ns=logger.start_ns, refused=dict(logger.refused))
