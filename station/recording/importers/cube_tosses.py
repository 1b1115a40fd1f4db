"""Real tosses of a cube onto a level board, followed by a camera; a Parquet table of poses.

Source: S. Pfrommer, M. Halm, M. Posa, "ContactNets: Learning Discontinuous Contact Dynamics with Smooth, Implicit
Representations" (CoRL 2020), data of github.com/DAIRLab/contact-nets.

Each toss becomes a run. The board is the plate: level throughout, its frame the plate frame (z up, origin where the
source has it, the cube's middle at half its height above it). No run has a slip onset, because nothing tilts: the
samples are censored at 0 rad. The source gives no date and no latency, so the tosses follow each other from a fixed
date on, half a second apart, and are received as they happen. Frames are taken as published, the tracking's outliers
too. Not carried: the published velocities, which are derived from the poses.
"""

from __future__ import annotations

import hashlib
import heapq
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from shared import frames
from shared.clock import SIMULATION_EPOCH_NS
from shared.errors import UserError
from shared.geometry import Array, euler_of
from shared.messages import BlockPose, Message, PlatformState, RunEvent, Sample
from station.recording.importers import Imported, Item
from station.recording.parquet import read_parquet
from station.recording.provenance import Attachment, Provenance
from station.signals.flags import NO_TILT
from station.signals.traced import Traced

NAME = "cube-tosses"
HELP = "the tossed cube of ContactNets (CoRL 2020): a Parquet table of poses"

RATE_HZ = 148.0
CUBE_SIDE_M = 0.1048
CUBE_MASS_KG = 0.37
PAUSE_NS = 500_000_000
LEVEL_NS = 10_000_000
FLAGS = (NO_TILT,)
_POSE = ("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz")
_COLUMNS = ("toss", "frame", *_POSE)
_REST_M = 1e-3
MOST_FRAMES = 148 * 3600
"""A toss lasts seconds; a larger number of a frame is none, and would make hours of messages."""
MOST_S = 3600.0
"""The 570 tosses of the source take ten minutes; the board's attitude is told a hundred times a second meanwhile."""
MOST_M = 1000.0
"""No board is larger: a unit is wrong, or the number is none."""


def read(source: Path, *, onset: Traced | None = None) -> Imported:  # noqa: ARG001 - nothing tilts
    """Reads the table and what lies beside it (README.md, LICENSE).

    Raises:
        UserError: if it is missing, not a Parquet table, lacks columns, or holds no toss.
    """
    table = _table(source)
    tosses = _split(table, source)
    places = np.concatenate([poses[:, :2] for _, _, poses in tosses])
    extent_m = float(np.nanmax(np.abs(places)))
    return Imported(provenance=_provenance(source, extent_m=extent_m), messages=_messages(tosses))


def _table(source: Path) -> dict[str, Array]:
    import pyarrow as pa  # noqa: PLC0415 - an extra, which the other importers do without

    try:
        table = read_parquet(source)
        missing = [name for name in _COLUMNS if name not in table.column_names]
    except OSError as error:
        why = error if source.is_file() else "there is no such file"
        raise UserError(f"Expected the table of tosses at {source}, but it cannot be read: {why}") from error
    except (pa.ArrowException, ValueError, KeyError) as error:
        raise UserError(f"Expected a Parquet table of tosses, but {source} is none ({error})") from error
    if missing:
        raise UserError(f"Expected the columns {', '.join(_COLUMNS)} in {source}, missing are {', '.join(missing)}")
    try:
        return {name: table[name].to_numpy().astype(float) for name in _COLUMNS}
    except (pa.ArrowException, ValueError, TypeError) as error:
        raise UserError(f"Expected numbers in the columns of {source}: {error}") from error


Toss = tuple[int, Array, Array]
"""Its number, the frames' numbers (n,), and their poses (n, 7): x y z in metres, qw qx qy qz."""


def _split(table: dict[str, Array], source: Path) -> list[Toss]:
    if not len(table["toss"]):
        raise UserError(f"Expected at least one toss in {source}, it holds none")
    if not np.all(np.isfinite(table["toss"]) & np.isfinite(table["frame"])):
        raise UserError(f"Expected a toss and a frame number in every row of {source}, some are empty")
    if not np.all((np.abs(table["toss"]) < 2**53) & (np.abs(table["frame"]) < MOST_FRAMES)):
        raise UserError(
            f"Expected tosses of less than an hour (frames below {MOST_FRAMES}) in {source}, got larger ones"
        )
    places = np.abs(np.stack([table["x_m"], table["y_m"]]))
    if not np.any(np.isfinite(places)) or np.any(places > MOST_M):
        raise UserError(f"Expected places on a board of at most {MOST_M:g} m in {source}, got none, or larger ones")
    tosses = _sorted(table)
    duration_s = sum(float(frame[-1] - frame[0]) for _, frame, _ in tosses) / RATE_HZ + len(tosses) * PAUSE_NS * 1e-9
    if duration_s > MOST_S:
        raise UserError(
            f"Expected tosses of at most {MOST_S:g} s together in {source}, got {duration_s:.0f} s; split it"
        )
    return tosses


def _sorted(table: dict[str, Array]) -> list[Toss]:
    order = np.lexsort((table["frame"], table["toss"]))
    number, frame = table["toss"][order], table["frame"][order]
    poses = np.column_stack([table[name] for name in _POSE])[order]
    starts = np.flatnonzero(np.diff(number, prepend=-math.inf))
    parts = zip(np.split(frame, starts[1:]), np.split(poses, starts[1:]), strict=True)
    return [(int(number[start]), *part) for start, part in zip(starts, parts, strict=True)]


def _messages(tosses: list[Toss]) -> Iterator[Item]:
    """Returns all tosses one after another, with the level board under them from beginning to end."""
    starts: list[int] = []
    start_ns = SIMULATION_EPOCH_NS
    for _, frame, _ in tosses:
        starts.append(start_ns)
        start_ns += round((frame[-1] - frame[0]) / RATE_HZ * 1e9) + PAUSE_NS
    board = (_level(stamp_ns) for stamp_ns in range(SIMULATION_EPOCH_NS, start_ns, LEVEL_NS))
    runs = _runs(tosses, starts)
    return heapq.merge(board, runs, key=lambda item: item[1])


def _level(stamp_ns: int) -> Item:
    return "arm/platform", stamp_ns, PlatformState(stamp_ns=stamp_ns, qw=1.0, frame_id=frames.PLATFORM)


def _runs(tosses: list[Toss], starts: list[int]) -> Iterator[Item]:
    seq = 0
    for (number, frame, poses), start_ns in zip(tosses, starts, strict=True):
        stamps = [start_ns + round(value / RATE_HZ * 1e9) for value in (frame - frame[0]).tolist()]
        yield _event(number, start_ns, "LEVEL", "released by hand above the level board")
        for stamp_ns, pose in zip(stamps, poses, strict=True):
            block = _block_pose(seq, stamp_ns, pose)
            seq += 1
            yield "block/pose", stamp_ns, block
            if block.found:
                yield "tf", stamp_ns, _transforms(block)
        yield _event(number, stamps[-1], "DONE", "at rest on one face")
        yield "session/sample", stamps[-1], _sample(number, stamps, poses)


def _transforms(block: BlockPose) -> Message:
    board = frames.platform_transform(PlatformState(stamp_ns=block.stamp_ns, qw=1.0))
    return frames.tf(board, frames.block_pose_transform(block))


def _event(run: int, stamp_ns: int, phase: str, reason: str) -> Item:
    return "session/event", stamp_ns, RunEvent(stamp_ns=stamp_ns, run=run, phase=phase, reason=reason)


def _block_pose(seq: int, stamp_ns: int, pose: Array) -> BlockPose:
    length = float(np.linalg.norm(pose[3:]))
    if not (np.all(np.isfinite(pose)) and length > 0.5):
        return BlockPose(stamp_ns=stamp_ns, seq=seq, reason="no pose in the source")
    x, y, z = pose[:3].tolist()
    qw, qx, qy, qz = (pose[3:] / length).tolist()
    return BlockPose(stamp_ns=stamp_ns, seq=seq, x=x, y=y, z=z, qw=qw, qx=qx, qy=qy, qz=qz, found=True)


def _sample(run: int, stamps: list[int], poses: Array) -> Sample:
    """Returns the row of a toss in the table of samples.

    It says where the toss began, when it came to rest, and that nothing tilted.
    """
    away = np.linalg.norm(poses[:, :3] - poses[-1, :3], axis=1)
    moving = np.flatnonzero(~(away <= _REST_M))
    x, y = poses[0, :2].tolist()
    return Sample(
        run=run,
        start_ns=stamps[0],
        euler_rad=(0.0, 0.0, 0.0),
        direction=-1,
        flags=FLAGS,
        block_mass_kg=CUBE_MASS_KG,
        block_area_m2=CUBE_SIDE_M**2,
        object="cube",
        plate="board",
        temperature_c=math.nan,
        relative_humidity=math.nan,
        censored=True,
        rest_ns=stamps[min(int(moving[-1]) + 1, len(stamps) - 1)] if len(moving) else stamps[0],
        start_x_m=x,
        start_y_m=y,
        start_yaw_rad=euler_of(*poses[0, 3:].tolist())[2],
    )


def _provenance(source: Path, *, extent_m: float) -> Provenance:
    beside = ((name, source.parent / name) for name in ("LICENSE", "README.md"))
    files = tuple(Attachment(name=name, data=path.read_bytes()) for name, path in beside if path.is_file())
    licence = "BSD 3-Clause, (c) 2020 Dynamic Autonomy and Intelligent Robotics Lab"
    if not any(file.name == "LICENSE" for file in files):
        licence += " (its text was not beside the table)"
    return Provenance(
        rig_id=NAME,
        started_ns=SIMULATION_EPOCH_NS,
        mode="import",
        rig_toml=_rig_toml(extent_m),
        attachments=files,
        extra={
            "importer": NAME,
            "source": source.name,
            "source_sha256": hashlib.sha256(source.read_bytes()).hexdigest(),
            "publication": 'Pfrommer, Halm, Posa: "ContactNets", CoRL 2020; data of github.com/DAIRLab/contact-nets',
            "licence": licence,
            "times": "the source gives none: tosses are laid one after another, half a second apart",
            "left_out": "the published velocities",
        },
    )


def _rig_toml(extent_m: float) -> str:
    """Gives plate and block for the views; the board's true size is not known, so it is drawn under every position."""
    side_m = math.ceil(2 * extent_m * 10 + 2) / 10
    size = f"{CUBE_SIDE_M}, {CUBE_SIDE_M}, {CUBE_SIDE_M}"
    return (
        f'id = "{NAME}"\n\n[plate]\nmaterial = "board"\nside_m = {side_m}\nopening_m = {side_m}\n\n'
        f'[block]\nname = "cube"\nmaterial = "plastic"\nsize_m = [{size}]\nmass_kg = {CUBE_MASS_KG}\n'
    )
