"""`station analyze` over many recordings: the samples of each, which are then analysed together."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypeVar

from shared.messages import CameraGeometry, Message, Sample
from station.app.many.each import Result, Row
from station.app.many.options import Command
from station.app.many.shown import Shown
from station.app.outputs import without_nan
from station.app.sessions import read_session
from station.friction.pairs import UNNAMED, Session

M = TypeVar("M", bound=Message)


def reading() -> Command:
    """Returns the command that reads each recording by itself."""
    return Command(
        name="analyze",
        work=read,
        asked={},
        shown=Shown(columns=("samples", "kept", "censored", "flagged", "pairs"), cells=_cells),
    )


def sessions_of(rows: Iterable[Row]) -> list[Session]:
    """Returns the sessions that could be read."""
    return [_session(row) for row in rows if row.status != "failed"]


def _session(row: Row) -> Session:
    own = row.result["geometry"]
    samples = tuple(_message(Sample, one) for one in row.result["samples"])
    return Session(
        samples, None if own is None else _message(CameraGeometry, own), row.recording, tuple(row.result["notes"])
    )


def read(path: Path, name: str) -> Result:
    """Returns a recording's samples and calibration as plain values."""
    session = read_session(path)
    geometry = session.geometry and without_nan(asdict(session.geometry))
    return {
        "recording": name,
        "samples": [without_nan(asdict(one)) for one in session.samples],
        "geometry": geometry,
        "notes": list(session.notes),
    }


def _message(cls: type[M], values: Mapping[str, Any]) -> M:
    """Returns the message of plain values; JSON has no nan."""
    return cls(**{name: _number(value) for name, value in values.items()})


def _number(value: Any) -> Any:
    if isinstance(value, list | tuple):
        return tuple(_number(one) for one in value)  # pyright: ignore[reportUnknownVariableType]
    return math.nan if value is None else value


def _cells(result: Result) -> tuple[str, ...]:
    samples = result["samples"]
    censored = sum(one["censored"] for one in samples)
    flagged = sum(bool(one["flags"]) and not one["censored"] for one in samples)
    pairs = sorted({f"{one['object'] or UNNAMED} on {one['plate'] or UNNAMED}" for one in samples})
    kept = len(samples) - censored - flagged
    return str(len(samples)), str(kept), str(censored), str(flagged), ", ".join(pairs) or "–"
