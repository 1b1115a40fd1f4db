"""A moving picture of a stretch of a session, as the replay shows it: for a README, a talk, a letter."""

from __future__ import annotations

import io
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from shared.errors import UserError
from station.app.pictured import near, telling_ns
from station.recording.reader import RecordingReader
from station.view import viewer
from station.view.rrd import write_rrd
from station.view.setup import Setup

BEFORE_S, AFTER_S = 5.0, 3.0
"""The stretch about the moment: the last degrees of the tilt, the slide, and the way back."""
SIZE_PX = (1200, 750)
SHOWN = 0.7
"""The picture is drawn larger than it is kept, which smooths its letters."""
_STEP_S = 0.2
_DRAWN_S = 0.15
"""A moment that was set is on the screen after some frames of the viewer."""
_UNSEEN = 4
"""Pictures that are thrown away first: on a busy machine the viewer still loads shapes while it draws them."""
_LAST_MS = 1500
_QUALITY = 60
KINDS = (".webp", ".gif")


def write_moving(reader: RecordingReader, out: Path, *, setup: Setup, at_s: float | None) -> int:
    """Draws the seconds about `at_s` after the recording's begin (None: about the last slip) into a WebP or a GIF.

    Returns:
        The number of its pictures.

    Raises:
        UserError: if it cannot be drawn here, or `out` cannot be written.
    """
    if out.suffix.lower() not in KINDS:
        raise UserError(f"Expected a name with {' or '.join(KINDS)} for a moving picture, got {out}")
    at_ns = telling_ns(reader) if at_s is None else reader.start_ns + round(at_s * 1e9)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "stretch.rrd"
        items = ((item.topic, item.message, item.publish_ns) for item in near(reader, at_ns))
        write_rrd(items, path, topics=reader.topics, setup=setup, name=reader.path.stem, start_ns=reader.start_ns)
        middle_s = (at_ns - reader.start_ns) * 1e-9
        last_s = (reader.end_ns - reader.start_ns) * 1e-9
        moments = np.arange(max(middle_s - BEFORE_S, 0.0), min(middle_s + AFTER_S, last_s), _STEP_S)
        return _write(list(_pictures(path, moments.tolist())), out)


def _pictures(path: Path, moments_s: list[float]) -> Iterator[bytes]:
    """Yields the viewer's picture of each moment, as a PNG."""
    with viewer.headless(size=SIZE_PX) as client:
        viewer.show(client, path, at_s=moments_s[0])
        for _ in range(_UNSEEN):
            viewer.picture_of(client)
        for moment_s in moments_s:
            viewer.move_to(client, moment_s)
            time.sleep(_DRAWN_S)
            yield viewer.without_bar(viewer.picture_of(client))


def _write(pictures: list[bytes], out: Path) -> int:
    from PIL import Image  # noqa: PLC0415  # only who wants a moving picture waits for it

    whole = [Image.open(io.BytesIO(one)).convert("RGB") for one in pictures]
    width, height = (round(SHOWN * side) for side in whole[0].size)
    shown = [one.resize((width, height), Image.Resampling.LANCZOS) for one in whole]
    lasting = [round(1e3 * _STEP_S)] * (len(shown) - 1) + [_LAST_MS]
    try:
        shown[0].save(out, save_all=True, append_images=shown[1:], duration=lasting, loop=0, quality=_QUALITY, method=6)
    except OSError as error:
        raise UserError(f"Expected to write the moving picture to {out}, but that failed: {error}") from error
    return len(shown)
