"""Tables: samples, tracks and tosses in CSV and Parquet, as spreadsheets and other programs write them."""

from __future__ import annotations

import csv
import io
from functools import cache, partial
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from station.friction.onset import estimate_onset
from station.recording.importers import importers, write
from station.recording.measured import read_measured
from station.recording.reader import open_recording
from station.recording.tables import write_samples
from tests.fuzz.change import ANY, of_bytes, of_text
from tests.fuzz.target import Target, command
from tests.unit.diagnosis.tables import samples
from tests.unit.recording.test_importers import made_up
from tests.unit.recording.test_tracks import two_runs

Columns = dict[str, list[Any]]
KINDS = (pa.string(), pa.int64(), pa.bool_(), pa.float16(), pa.list_(pa.float64()), pa.binary())


@cache
def _samples_csv() -> bytes:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "samples.csv"
        write_samples(samples(grain=0.2)[:12], path)
        return path.read_bytes()


@cache
def _tracks() -> Columns:
    """Every eighth row of two slides."""
    return {name: list(column[::8]) for name, column in two_runs().items()}


@cache
def _tosses() -> Columns:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "tosses.parquet"
        made_up(path)
        return pq.read_table(path).slice(0, 60).to_pydict()


@cache
def _samples() -> Columns:
    rows = list(csv.DictReader(io.StringIO(_samples_csv().decode())))
    return {name: [_value(row[name]) for row in rows] for name in rows[0]}


def _value(cell: str) -> Any:
    for kind in (int, float):
        try:
            return kind(cell)
        except ValueError:
            continue
    return cell


def _csv_of(columns: Columns) -> bytes:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    return text.getvalue().encode()


def _csv(text: bytes, random: Random) -> bytes:
    return of_text(random, text)


def _parquet(columns: Columns, random: Random) -> bytes:
    """Columns of other kinds, with other values, left out or renamed; or bytes of the file changed."""
    table: dict[str, Any] = {name: list(column) for name, column in columns.items()}
    for _ in range(random.choice((1, 1, 2, 5))):
        name = random.choice([*table])
        values = list(table[name])
        table[name] = values
        what = random.random()
        if what < 0.3 and values:
            values[random.randrange(len(values))] = random.choice(ANY)
        elif what < 0.5:
            table[name] = [random.choice(ANY)] * len(values)
        elif what < 0.7:
            kind = random.choice(
                (pa.string(), pa.int64(), pa.bool_(), pa.float16(), pa.list_(pa.float64()), pa.binary())
            )
            table[name] = _cast(values, kind)
        elif len(table) > 1:
            table.pop(name)
    stream = io.BytesIO()
    try:
        pq.write_table(pa.table({name: _array(values) for name, values in table.items()}), stream)
    except (pa.ArrowException, ValueError):  # columns that no Parquet file can have
        return of_bytes(random, _whole(tuple(columns)))
    data = stream.getvalue()
    return of_bytes(random, data) if random.random() < 0.3 else data


@cache
def _whole(names: tuple[str, ...]) -> bytes:
    """A table of that many columns of zeros."""
    stream = io.BytesIO()
    pq.write_table(pa.table({name: [0.0, 0.0] for name in names}), stream)
    return stream.getvalue()


def _cast(values: Any, kind: Any) -> Any:
    try:
        return pa.array(values).cast(kind)
    except (pa.ArrowException, ValueError, TypeError, OverflowError):
        return pa.nulls(len(values), kind)


def _array(values: Any) -> Any:
    """The values as a column; as texts where they are of kinds that do not go together."""
    if isinstance(values, pa.Array | pa.ChunkedArray):
        return values
    try:
        return pa.array(values)
    except (pa.ArrowException, ValueError, TypeError, OverflowError, UnicodeError):
        return pa.array([str(value).encode("utf-8", "replace").decode() for value in values])


def _import(name: str, path: Path) -> None:
    """Imports a table and writes it; what was written can be opened."""
    out = path.with_name("imported.mcap")
    write(importers()[name].read(path, onset=estimate_onset), out, overwrite=True)
    open_recording(out).samples()


def _measured(path: Path) -> None:
    read_measured(path)


TARGETS = (
    Target("samples.csv", ".csv", lambda random: _csv(_samples_csv(), random), command("samples", "{file}"), share=2.0),
    Target("samples.parquet", ".parquet", lambda random: _parquet(_samples(), random), command("samples", "{file}")),
    Target("table to diagnose, csv", ".csv", lambda random: _csv(_samples_csv(), random), _measured, share=2.0),
    Target("table to diagnose, parquet", ".parquet", lambda random: _parquet(_samples(), random), _measured),
    Target(
        "tracks.csv", ".csv", lambda random: _csv(_csv_of(_tracks()), random), partial(_import, "tracks"), share=1.5
    ),
    Target("tracks.parquet", ".parquet", lambda random: _parquet(_tracks(), random), partial(_import, "tracks")),
    Target("tosses.parquet", ".parquet", lambda random: _parquet(_tosses(), random), partial(_import, "cube-tosses")),
)
