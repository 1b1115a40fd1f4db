"""`station samples` over many recordings: their samples as a Parquet dataset, partitioned by rig and session.

A recording is one file in `rig=…/session=…`, as Hive lays it out: readers make columns of these names. A session's name
is the time of its start (UTC) with the first digits of the recording's digest, as simulated sessions all start at once.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import quote

from shared.errors import UserError
from shared.messages import Sample
from station.app.attached import planted_in_recording
from station.app.foam import free_of_foam_m
from station.app.many.each import Kept, Result
from station.app.many.key import digest_of
from station.app.many.options import Command
from station.app.many.shown import Shown
from station.recording.provenance import whole_number
from station.recording.reader import RecordingReader, digest, open_recording
from station.recording.summary import is_kept
from station.recording.tables import arrow_table, read_samples

UNKNOWN = "__HIVE_DEFAULT_PARTITION__"
"""Hive's name for a partition whose value is null: a table says nothing of its rig."""
_STARTED = "%Y%m%dT%H%M%SZ"
_DIGITS = 8


@dataclass(frozen=True, kw_only=True)
class Origin:
    """The rig's name, the session's name and the seed of a recording; what it does not tell is None."""

    rig: str | None
    session: str
    seed: int | None


def sampling(*, out: Path | None, with_digest: bool) -> Command:
    """Returns the command that reads each recording, and with an output folder makes it a part of the dataset there."""
    asked = {"digest": with_digest, "dataset": out is not None}
    kept = Kept.of(out, "samples", asked) if out else None
    return Command(
        name="samples",
        work=partial(sampled, dataset=kept, with_digest=with_digest),
        asked=asked,
        shown=Shown(columns=("rig", "session", "seed", "samples", "kept", "left out"), cells=_cells),
    )


def sampled(path: Path, name: str, *, dataset: Kept | None, with_digest: bool) -> Result:
    """Returns a recording's samples: where they come from, how many there are, and the file that now holds them.

    `left_out` are payloads by topic that stand in the place of samples and are none, `notes` what the rig conceals.
    """
    reader = open_recording(path) if path.name.endswith((".mcap", ".mcap.partial")) else None
    samples, content = reader.samples() if reader else read_samples(path), digest_of(path)
    origin = _origin(reader, content)
    facts: dict[str, Any] = {
        "recording": name,
        "rig": origin.rig,
        "session": origin.session,
        "seed": origin.seed,
        "runs": len(samples),
        "kept": sum(is_kept(sample) for sample in samples),
        "left_out": dict(reader.malformed) if reader else {},
        "notes": list(planted_in_recording(reader)) if reader else [],
    }
    if with_digest and reader is not None:
        facts["digest"] = digest(reader)
    if dataset is not None:
        free_m = free_of_foam_m(samples, path)
        facts["files"] = [_write(dataset, samples, free_m=free_m, name=name, origin=origin, content=content)]
    return facts


def _origin(reader: RecordingReader | None, content: str) -> Origin:
    """Returns the origin that the recording's metadata tell; what is no number in them is left out."""
    session = reader.metadata.get("session", {}) if reader else {}
    started_ns, seed = whole_number(session.get("started_ns", "")), whole_number(session.get("seed", ""))
    if started_ns is None and reader is not None:
        started_ns = reader.start_ns
    began = "" if started_ns is None else f"{datetime.fromtimestamp(started_ns // 10**9, UTC):{_STARTED}}-"
    return Origin(rig=session.get("rig_id") or None, session=f"{began}{content[:_DIGITS]}", seed=seed)


def _write(
    dataset: Kept, samples: Sequence[Sample], *, free_m: dict[str, list[float]], name: str, origin: Origin, content: str
) -> str:
    """Writes one file of the dataset, whole or not at all, in the place of that of an earlier version.

    Every file has every column, those that nothing is known of too.

    Raises:
        UserError: if it cannot be written.
    """
    import pyarrow as pa  # noqa: PLC0415  # an extra, and slow to load
    import pyarrow.parquet as pq  # noqa: PLC0415

    count = len(samples)
    table = arrow_table(samples, more={"foam_free_m": [float("nan")] * count, **free_m})
    table = table.append_column("recording", pa.array([name] * count, type=pa.string()))
    table = table.append_column("seed", pa.array([origin.seed] * count, type=pa.int64()))
    folder = Path(f"rig={_part(origin.rig)}", f"session={_part(origin.session)}")
    path = dataset.folder / folder / f"{dataset.stem(content)}.parquet"
    growing = path.with_name(f".{path.name}.{os.getpid()}-{threading.get_ident()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        pq.write_table(table, growing)
        os.replace(growing, path)
        for other in path.parent.glob(f"{path.stem.partition('-')[0]}-*.parquet"):
            if other != path:
                other.unlink()
    except OSError as error:
        raise UserError(f"Expected to write the samples to {path}, but that failed: {error.strerror}") from error
    return (folder / path.name).as_posix()


def _part(value: str | None) -> str:
    """Returns the name of a partition; what a path could take for something else is written in hexadecimal digits."""
    return UNKNOWN if value is None else quote(value, safe=" ")[:200]


def _cells(result: Result) -> tuple[str, ...]:
    seed = result["seed"]
    return (
        result["rig"] or "–",
        result["session"],
        "–" if seed is None else str(seed),
        str(result["runs"]),
        str(result["kept"]),
        str(sum(result["left_out"].values()) or "–"),
    )
