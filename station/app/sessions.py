"""Sessions for the analysis: the samples of a recording or a table, with a calibration where there is one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields
from functools import partial
from pathlib import Path

from shared.errors import UserError
from shared.messages import CameraGeometry, Sample
from shared.system.processes import usable_processors
from station.app.attached import planted_in_recording
from station.friction.pairs import Session
from station.pool import spread
from station.recording.arrays import first_geometry
from station.recording.reader import open_recording
from station.recording.tables import read_samples

_WORTH_A_PROCESS_BYTES = 400_000_000
"""Bytes below which starting processes takes longer than they save: some two seconds of reading."""


def read_session(path: Path, *, spare: CameraGeometry | None = None) -> Session:
    """Reads a file's samples with its own calibration, or the spare one.

    Raises:
        UserError: if the file cannot be read, or an angle is none in radians.
    """
    if path.suffixes[-2:] == [".mcap", ".partial"]:
        raise UserError(f"Expected a finished recording, but {path} was broken off; run: station repair {path}")
    samples = read_samples(path)
    if path.suffix != ".mcap":
        return session_of(samples, geometry=spare, source=str(path))
    notes = planted_in_recording(open_recording(path))
    return session_of(samples, geometry=geometry_of(path) or spare, source=str(path), notes=notes)


def session_of(
    samples: Sequence[Sample], *, geometry: CameraGeometry | None, source: str, notes: tuple[str, ...] = ()
) -> Session:
    """Returns the samples as a session of that name.

    Raises:
        UserError: if an angle is none in radians.
    """
    for sample in samples:
        _check(sample, source)
    return Session(samples, geometry, source, notes)


def read_sessions(
    paths: Sequence[Path], *, spare: CameraGeometry | None = None, jobs: int | None = None
) -> list[Session]:
    """Reads the sessions of files, in their order; large recordings are read with all cores (or `jobs` processes).

    Memory is bounded by the samples and a chunk for each process, however long the recordings are.

    Raises:
        UserError: as `read_session`.
    """
    sizes = [path.stat().st_size for path in paths if path.suffix == ".mcap" and path.exists()]
    jobs = min(jobs or usable_processors(), len(sizes))
    if jobs < 2 or sum(sizes) < _WORTH_A_PROCESS_BYTES:
        return [read_session(path, spare=spare) for path in paths]
    with spread(partial(read_session, spare=spare), paths, jobs=jobs) as read:
        return list(read)


def require_different(sessions: Sequence[Session]) -> None:
    """Refuses samples that come twice: each would count as two, and every interval would be too narrow.

    Raises:
        UserError: naming the two files.
    """
    seen: dict[tuple[object, ...], str] = {}
    for session in sessions:
        keys = [(one.start_ns, one.run, one.onset_angle_rad, one.reference_corners_px) for one in session.samples]
        # Tables of other rigs may have nothing that tells one run from another.
        known = {key for key in keys if key[3]}
        twice = [seen[key] for key in known if key in seen]
        if twice:
            raise UserError(
                f"Expected every sample once, but {len(twice)} of {session.source} are in {twice[0]}, too; "
                "name only one of the two"
            )
        seen.update(dict.fromkeys(known, session.source))


def geometry_of(path: Path) -> CameraGeometry | None:
    """Returns the first calibration of a recording; a session has one."""
    return first_geometry(open_recording(path))


def _check(sample: Sample, source: str) -> None:
    for spec in fields(sample):
        value = getattr(sample, spec.name)
        numbers = value if isinstance(value, tuple) else (value,)
        if any(isinstance(number, float) and math.isinf(number) for number in numbers):
            raise UserError(f"{source}, run {sample.run}: expected a finite {spec.name}, got {value}")
    angle = sample.onset_angle_rad
    if not (0 <= angle < math.pi / 2 and (angle > 0 or sample.censored)):
        raise UserError(
            f"{source}, run {sample.run}: expected onset_angle_rad between 0 and {math.pi / 2:.3f}, got {angle:g}; "
            "are these degrees?"
        )
