"""The tables of a dataset, as Arrow: a row for each sample, and a row for each run with the block's path in it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from station.publish.source import Source
from station.recording.arrays import run_signals
from station.recording.tables import arrow_table
from station.signals.session import Signals
from station.signals.tracks import Booleans, EventTrack, Times
from station.simulators.recorded_runs import poses_of

if TYPE_CHECKING:
    import pyarrow as pa

ORIGIN = ("recording", "rig", "session", "seed", "mode")
"""The first columns of every table: they say where a row comes from."""
_ENDS = ("DONE", "ABORTED")
_WITHIN_A_PHASE = ("STEP_BEGIN", "STEP_END", "SYNC")
More = Mapping[str, Sequence[float]]


def samples_table(sources: Sequence[Source], more: Sequence[More]) -> pa.Table:  # pyright: ignore[reportUnknownParameterType]  # pyarrow has no types
    """Returns the samples of all recordings.

    `more` has further columns of each recording, nan where another lacks them.
    """
    import pyarrow as pa  # noqa: PLC0415  # an extra, and slow to load

    names = list(dict.fromkeys(name for columns in more for name in columns))
    tables = [_samples_of(source, columns, names) for source, columns in zip(sources, more, strict=True)]
    return pa.concat_tables(tables)


def _samples_of(source: Source, more: More, names: Sequence[str]) -> pa.Table:  # pyright: ignore[reportUnknownParameterType]  # pyarrow has no types
    count = len(source.samples)
    filled = {name: more.get(name, [math.nan] * count) for name in names}
    table = arrow_table(source.samples, more=filled)
    for index, (name, column) in enumerate(_origin(source, count).items()):
        table = table.add_column(index, name, column)
    return table


def _origin(source: Source, count: int) -> dict[str, pa.Array]:  # pyright: ignore[reportUnknownParameterType]  # pyarrow has no types
    import pyarrow as pa  # noqa: PLC0415

    kinds = {"recording": pa.string(), "rig": pa.string(), "session": pa.string(), "seed": pa.int64()}
    values = {"recording": source.name, **{name: getattr(source, name) for name in ORIGIN[1:]}}
    return {name: pa.array([values[name]] * count, type=kinds.get(name, pa.string())) for name in ORIGIN}


def runs_table(sources: Sequence[Source]) -> pa.Table:  # pyright: ignore[reportUnknownParameterType]  # pyarrow has no types
    """Returns the runs of all recordings, aborted ones too.

    One run's signals are in memory at a time, and its row after that.

    `started_ns` and `ended_ns` are the first and last event; times in lists (`…_s`) count from the first. `x_m`,
    `y_m` and `yaw_rad` are the block in the plate frame, at `path_s`; `tilt_rad` is the plate against gravity, at
    `tilt_s`.
    """
    import pyarrow as pa  # noqa: PLC0415

    rows = [row for source in sources for row in _runs_of(source)]
    return pa.Table.from_pylist(rows, schema=_runs_schema())


def _runs_schema() -> pa.Schema:  # pyright: ignore[reportUnknownParameterType]  # pyarrow has no types
    import pyarrow as pa  # noqa: PLC0415

    texts, numbers = pa.list_(pa.string()), pa.list_(pa.float64())
    origin = [(name, pa.int64() if name == "seed" else pa.string()) for name in ORIGIN]
    own = [("run", pa.int64()), ("started_ns", pa.int64()), ("ended_ns", pa.int64())]
    end = [("end", pa.string()), ("reason", pa.string()), ("phases", texts), ("phase_s", numbers)]
    lists = [(name, numbers) for name in ("path_s", "x_m", "y_m", "yaw_rad", "tilt_s", "tilt_rad")]
    return pa.schema([*origin, *own, *end, *lists])


def _runs_of(source: Source) -> Iterator[dict[str, Any]]:
    origin = {"recording": source.name, **{name: getattr(source, name) for name in ORIGIN[1:]}}
    for run, signals in run_signals(source.reader):
        phases = signals.events.select((signals.events.run == run) & ~np.isin(signals.events.phase, _WITHIN_A_PHASE))
        if len(phases):  # the small motion before the first run has none
            yield origin | _run(run, signals, phases)


def _run(run: int, signals: Signals, events: EventTrack) -> dict[str, Any]:
    every = signals.events.time_ns[signals.events.run == run]
    start_ns, end_ns = int(every.min()), int(every.max())
    ended = np.flatnonzero(np.isin(events.phase, _ENDS))
    times = {"run": run, "started_ns": start_ns, "ended_ns": end_ns}
    end = {"end": str(events.phase[ended[-1]]), "reason": str(events.reason[ended[-1]])} if len(ended) else {}
    phases = {"phases": [str(phase) for phase in events.phase], "phase_s": _since(events.time_ns, start_ns)}
    return {**times, "end": "", "reason": "", **end, **phases, **_motion(signals, start_ns, end_ns)}


def _motion(signals: Signals, start_ns: int, end_ns: int) -> dict[str, list[float]]:
    """Returns the block's path and the plate's tilt from the run's begin to its end."""
    poses, attitude = poses_of(signals), signals.attitude.known()
    seen, held = _within(poses.time_ns, start_ns, end_ns), _within(attitude.time_ns, start_ns, end_ns)
    x_m, y_m, yaw_rad = poses.pose[seen].T
    path = {"path_s": _since(poses.time_ns[seen], start_ns), "x_m": x_m.tolist(), "y_m": y_m.tolist()}
    tilt = {"tilt_s": _since(attitude.time_ns[held], start_ns), "tilt_rad": attitude.tilt_rad[held].tolist()}
    return {**path, "yaw_rad": yaw_rad.tolist(), **tilt}


def _within(time_ns: Times, start_ns: int, end_ns: int) -> Booleans:
    return (time_ns >= start_ns) & (time_ns <= end_ns)


def _since(time_ns: Times, start_ns: int) -> list[float]:
    return ((time_ns - start_ns) * 1e-9).tolist()
