"""A session's signals with enough runs to diagnose: the golden session's three runs, simulated again and again."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import fields, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from shared.config import Table
from shared.rig import RigConfig, rig_of_table
from station.physics.model import Model
from station.recording.arrays import load_signals
from station.recording.reader import open_recording
from station.signals.session import Signals
from station.simulators.simulator import simulator

GOLDEN = Path(__file__).parents[2] / "golden" / "session.mcap"
REPEATS = 8
OPENING_RADIUS_M = 0.08


@cache
def golden() -> tuple[Signals, RigConfig]:
    reader = open_recording(GOLDEN)
    text = reader.attachments["rig.toml"].decode()
    return load_signals(reader), rig_of_table(Table(tomllib.loads(text), "rig.toml", text))


@cache
def session() -> Signals:
    """24 runs with 5 % scatter and the corners' noise, without any effect, and with the foam out of reach."""
    recorded, rig = golden()
    rig = replace(rig, plate=replace(rig.plate, opening_m=2 * OPENING_RADIUS_M))
    rng = np.random.default_rng(4)
    model = Model(mu_s=0.35, scatter=0.05)
    return joined([simulator("planar").repeat(recorded, model, rig=rig, rng=rng) for _ in range(REPEATS)])


def joined(parts: Sequence[Signals], *, first_run: int = 0, runs: int = 3) -> Signals:
    """Sessions of so many runs one after another, numbered through from the first one's number, and by so much more."""
    length = int(max(part.corners.time_ns[-1] for part in parts) - min(part.corners.time_ns[0] for part in parts))
    moved = [
        later(part, place * (length + 10_000_000_000), first_run + runs * place) for place, part in enumerate(parts)
    ]
    names = ("corners", "attitude", "commands", "motions", "events", "environment", "block")
    tracks: dict[str, Any] = {name: _stacked([getattr(part, name) for part in moved]) for name in names}
    samples = tuple(sample for part in moved for sample in part.samples)
    return replace(moved[0], **tracks, fiducials={}, angles={}, samples=samples)


def later(part: Signals, by_ns: int, runs: int) -> Signals:
    """The same session by so much later, its runs numbered by so much more."""
    names = ("corners", "attitude", "commands", "motions", "events", "environment", "block")
    tracks: dict[str, Any] = {name: _shifted(getattr(part, name), by_ns, runs) for name in names}
    return replace(part, **tracks, samples=tuple(_shifted(sample, by_ns, runs) for sample in part.samples))


def _shifted(thing: Any, by_ns: int, runs: int) -> Any:
    changed: dict[str, Any] = {}
    for spec in fields(thing):
        value = getattr(thing, spec.name)
        if spec.name.endswith("_ns"):
            changed[spec.name] = np.where(value > 0, value + by_ns, value) if isinstance(value, np.ndarray) else value
            if isinstance(value, int):
                changed[spec.name] = value + by_ns if value > 0 else value
        elif spec.name == "run":
            changed[spec.name] = value + runs * (value > 0)  # run 0 is the small motion before the first run
    return replace(thing, **changed)


def _stacked(tracks: Sequence[Any]) -> Any:
    joined_fields: dict[str, Any] = {}
    for spec in fields(tracks[0]):
        values = [getattr(track, spec.name) for track in tracks]
        joined_fields[spec.name] = (
            np.concatenate(values) if isinstance(values[0], np.ndarray) else sum(values, type(values[0])())
        )
    return replace(tracks[0], **joined_fields)
