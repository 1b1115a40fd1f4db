"""Judges the parts of a rig by what was heard of them: camera, arm, clocks and disk."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path

from shared.messages import AgentStatus, ClockOffset
from station.app.display.moment import Health
from station.recording.checkup.rate import RATE_SHARE
from station.recording.writer import MIN_FREE_BYTES, partial_path

SOON_FULL = 10
"""Times the room at which a recording stops: from here on the disk needs a look."""


def silence(part: str, text: str, *, ended: bool) -> Health:
    """Returns a part that says nothing, in the words of `text`: a fault, unless the session has `ended`."""
    if ended:
        return Health(part=part, well=True, text="silent, as the session has ended", off=True)
    return Health(part=part, well=False, text=text)


def camera(status: AgentStatus | None, *, nominal_hz: float) -> Health:
    """Gives the camera by its agent's status. The rate is low where `station doctor` would reject it in the recording.

    A slide is timed by its frames: at 5°/s the plate turns by 0.06° between frames at 90 Hz, by 0.2° at 25 Hz. A second
    of `make run` on idle cores has 87 to 91 of 90 frames, 97 % and more. A `nominal_hz` of 0 judges no rate.
    """
    if status is None:
        return Health(part="camera", well=True, text="no status yet")
    low = status.rate_hz < RATE_SHARE * nominal_hz
    text = status.fault or _rate(status, nominal_hz, low=low)
    return Health(part="camera", well=not (status.fault or low), text=text)


def _rate(status: AgentStatus, nominal_hz: float, *, low: bool) -> str:
    wanted = f"only {status.rate_hz:.1f} of {nominal_hz:g}" if low else f"{status.rate_hz:.1f}"
    share = status.dropped / max(status.frames + status.dropped, 1)
    lost = f" ({100 * share:.0f} %)" if low and status.dropped else ""
    warm = f", {status.temperature_c:.0f} °C" if status.temperature_c > 0 else ""  # nan, or never told: unknown
    return f"{wanted} frames/s, {status.dropped} dropped{lost}{warm}"


def clocks(known: Mapping[str, ClockOffset], *, ended: bool) -> Health:
    """Returns the offset of each agent's clock."""
    if not known:
        return silence("clock", "not measured yet", ended=ended)
    offsets = [
        f"{agent} {1e-6 * at.offset_ns:+.2f} ± {1e-6 * at.sigma_ns:.2f} ms" for agent, at in sorted(known.items())
    ]
    return Health(part="clock", well=True, text=", ".join(offsets))


def disk(paths: Sequence[Path]) -> Health:
    """Returns the size of the recording at the first of these paths that has it, and the room left on its disk."""
    files = [file for path in paths for file in (partial_path(path), path) if file.exists()]
    written = f"{1e-6 * files[0].stat().st_size:.1f} MB written" if files else "no recording in this folder"
    free = _free_bytes(files[0] if files else paths[0])
    if free is None:
        return Health(part="disk", well=True, text=f"{written}, room unknown", off=True)
    return Health(part="disk", well=free > SOON_FULL * MIN_FREE_BYTES, text=f"{written}, {1e-9 * free:.1f} GB free")


def _free_bytes(path: Path) -> int | None:
    """Returns the room on the disk of a path: that of its nearest folder that exists."""
    folder = next((each for each in path.absolute().parents if each.is_dir()), None)
    try:
        return None if folder is None else shutil.disk_usage(folder).free
    except OSError:  # a network's disk that is gone
        return None
