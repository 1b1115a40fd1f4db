"""Runs as time series: a table with the block's place on the plate and the plate's attitude, .csv or .parquet.

A row is a moment of a run: `run`, `t_s`, `x_m`, `y_m`, `yaw_rad` in the plate's frame, or the corners of the block's
mark in a camera's picture, and `tilt_rad` with `azimuth_rad`, or `plate_qw` to `plate_qz`. A table of the runs of a
simulation is imported likewise. A run whose plate tilts gets an onset. A slide down a plate that does not turn has
none, and neither has a toss onto a level one; a block that holds on a fixed plate shows that its friction is larger.
Runs follow each other on one clock, or each has its own; then the time between them is unknown and laid out evenly, so
that a simulated run gets the recorded one's stamps.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from shared import frames
from shared.clock import SIMULATION_EPOCH_NS
from shared.geometry import Array, euler_of
from shared.messages import PlatformState, RunEvent, Sample
from station.recording.importers import Imported, Item
from station.recording.importers.tracks.block import Poses, block_of
from station.recording.importers.tracks.corners import with_corners
from station.recording.importers.tracks.lacks import lacking
from station.recording.importers.tracks.plate import attitude, azimuth_of, downhill_of
from station.recording.importers.tracks.runs import Run, each, has_one_clock, runs_of
from station.recording.importers.tracks.slips import Motion, Slip, held, refuse_other_ways, released, slip_of
from station.recording.importers.tracks.table import Tracks, read_table
from station.recording.provenance import Provenance
from station.signals.flags import NO_TILT, UNRESOLVED
from station.signals.measured import left_alone
from station.signals.traced import Traced

NAME = "tracks"
HELP = (
    "runs as time series, of a block on a plate: a CSV or Parquet table of poses, or of a mark's corners, and attitudes"
)

UNKNOWN_SIDE_M = 0.01
"""The side of a block of unknown area, as in a rig file that does not say it."""


def read(source: Path, *, onset: Traced | None = None) -> Imported:
    """Reads the table; without `onset` the onsets stay where the block had visibly moved.

    Raises:
        UserError: if it is missing, no table, lacks what a run needs, or says what cannot be.
    """
    table, corners = with_corners(read_table(source))
    runs, plate = runs_of(table), attitude(table)
    block = block_of(table, runs, corners)
    motions = [_motion(run, plate, block) for run in runs]
    fixed = sum(not motion.tilts for motion in motions)
    slips = [slip_of(motion, onset=onset) if motion.tilts else held(motion) for motion in motions]
    refuse_other_ways(motions, slips, str(source))
    runs = tuple(run.rest_of(released(motion)) for run, motion in zip(runs, motions, strict=True))
    return Imported(
        provenance=_provenance(table, block, source),
        messages=_messages(table, runs, plate, block, slips),
        notes=tuple(_notes(table)),
        lacking=lacking(table, one_clock=has_one_clock(table, runs), fixed=fixed, runs=len(runs)),
    )


def _notes(table: Tracks) -> Iterator[str]:
    if table.ignored:
        said = left_alone(table.ignored)
        yield f"{said[0].upper()}{said[1:]}."


def _motion(run: Run, plate: Array, block: Poses) -> Motion:
    found = block.found[run.rows]
    return Motion(time_ns=run.time_ns, plate=plate[run.rows], place_m=block.place_m[run.rows], found=found)


def _messages(
    table: Tracks, runs: tuple[Run, ...], plate: Array, block: Poses, slips: list[Slip | None]
) -> Iterator[Item]:
    seq = 0
    for run, slip, known in zip(runs, slips, _facts(table, runs), strict=True):
        first, last = int(run.time_ns[0]), int(run.time_ns[-1])
        if block.corners is not None:
            yield "camera/geometry", first, replace(block.corners.geometry, stamp_ns=first)
        yield _event(run, first, "LEVEL")
        yield from _moments(run, plate, block, slip, first_seq=seq)
        seq += len(run.rows)
        yield _event(run, last, "DONE")
        own = plate[run.rows]
        yield "session/sample", last, _sample(run, own, block, slip, known)


def _moments(run: Run, plate: Array, block: Poses, slip: Slip | None, *, first_seq: int) -> Iterator[Item]:
    """Yields the readings of a run in order of their times, numbered from `first_seq`, with the events of its tilt."""
    due = [] if slip is None else [(slip.tilt_ns, "TILT"), (slip.detect_ns, "SLIP")]
    for seq, (row, stamp_ns) in enumerate(zip(run.rows.tolist(), run.time_ns.tolist(), strict=True), start=first_seq):
        qw, qx, qy, qz = plate[row].tolist()
        state = PlatformState(stamp_ns=stamp_ns, qw=qw, qx=qx, qy=qy, qz=qz, frame_id=frames.PLATFORM)
        yield "arm/platform", stamp_ns, state
        pose = block.message(row, seq=seq, stamp_ns=stamp_ns)
        if block.corners is None:
            yield "block/pose", stamp_ns, pose
        else:
            yield "camera/corners", stamp_ns, block.corners.message(row, seq=seq, stamp_ns=stamp_ns)
        if pose.found:
            yield "tf", stamp_ns, frames.tf(frames.platform_transform(state), frames.block_pose_transform(pose))
        for moment_ns, phase in due:
            if moment_ns == stamp_ns:
                yield _event(run, stamp_ns, phase)


def _event(run: Run, stamp_ns: int, phase: str) -> Item:
    return "session/event", stamp_ns, RunEvent(stamp_ns=stamp_ns, run=run.number, phase=phase, reason="imported")


def _facts(table: Tracks, runs: tuple[Run, ...]) -> Iterator[Sample]:
    """Yields each run's sample with what the table says of the whole run."""
    fields = ("mass", "area", "temperature", "relative_humidity", "plate_mount", "dwell")
    known = zip(runs, *(each(table, field, runs) for field in fields), strict=True)
    for run, mass, area, temperature, humidity, mount, dwell in known:
        yield Sample(
            run=run.number,
            start_ns=int(run.time_ns[0]),
            direction=-1,
            block_mass_kg=_or_0(mass),
            block_area_m2=_or_0(area),
            temperature_c=temperature,
            relative_humidity=humidity,
            plate_mount_rad=_or_0(mount),
            dwell_s=_or_0(dwell),
            object=table.group[run.rows[0]] if table.group else "",
        )


def _or_0(value: float) -> float:
    return 0.0 if math.isnan(value) else value


def _sample(run: Run, plate: Array, block: Poses, slip: Slip | None, facts: Sample) -> Sample:
    first = run.rows[block.found[run.rows]][0]
    x, y = block.place_m[first].tolist()
    begun = replace(facts, start_x_m=x, start_y_m=y, start_yaw_rad=float(block.yaw_rad[first]))
    if slip is None:
        return replace(begun, euler_rad=euler_of(*plate[0].tolist()), flags=(NO_TILT,), censored=True)
    return replace(
        begun,
        slip_ns=slip.slip_ns,
        detect_ns=slip.detect_ns,
        rest_ns=slip.tilt_ns - round(facts.dwell_s * 1e9) if facts.dwell_s else 0,
        azimuth_rad=azimuth_of(downhill_of(plate[[slip.frame]])[0]),
        onset_angle_rad=slip.angle_rad,
        onset_sigma_rad=slip.sigma_rad,
        flags=() if slip.resolved else (UNRESOLVED,),
        censored=not slip.slip_ns,
        step_to_rad=0.0 if slip.resolved else slip.sigma_rad * math.sqrt(12.0),
    )


def _provenance(table: Tracks, block: Poses, source: Path) -> Provenance:
    return Provenance(
        rig_id=NAME,
        started_ns=SIMULATION_EPOCH_NS,
        mode="import",
        rig_toml=_rig_toml(table, block),
        extra={
            "importer": NAME,
            "source": source.name,
            "source_sha256": hashlib.sha256(source.read_bytes()).hexdigest(),
        },
    )


def _rig_toml(table: Tracks, block: Poses) -> str:
    """Returns plate and block; the table says nothing of a foam, so its opening is out of every block's reach."""
    side_m, mass_kg = math.sqrt(_typical(table, "area", UNKNOWN_SIDE_M**2)), _typical(table, "mass", 0.008)
    reach_m = 4.0 * (float(np.abs(block.place_m[block.found]).max()) + side_m)
    return (
        f'id = "{NAME}"\n\n[plate]\nside_m = {reach_m:.4f}\nopening_m = {reach_m:.4f}\n\n'
        f"[block]\nsize_m = [{side_m:.6f}, {side_m:.6f}, {side_m:.6f}]\nmass_kg = {mass_kg:.6f}\n"
        + ("" if block.corners is None else block.corners.camera.rig_toml())
    )


def _typical(table: Tracks, quantity: str, otherwise: float) -> float:
    values = table.numbers.get(quantity, np.zeros(0))
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else otherwise
