"""The block in a table of tracks."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from shared.errors import UserError
from shared.messages import BlockPose
from station.recording.importers.tracks.corners import Corners
from station.recording.importers.tracks.runs import Run
from station.recording.importers.tracks.table import Tracks

POSE = ("x", "y", "yaw")


class Poses:
    """The block's poses: x, y, yaw, and z, roll, pitch where the table has them; `corners` if they come from these."""

    def __init__(self, table: Tracks, corners: Corners | None = None) -> None:
        self.corners = corners
        zeros = np.zeros(len(table))
        own = {name: table.numbers.get(name, zeros) for name in (*POSE, "z", "roll", "pitch")}
        self.place_m = np.column_stack([own["x"], own["y"]])
        self.yaw_rad = own["yaw"]
        self.found = np.asarray(np.isfinite(np.column_stack(list(own.values()))).all(axis=1), dtype=np.bool_)
        self._z = own["z"]
        turns = np.column_stack([own["yaw"], own["pitch"], own["roll"]])
        self._quaternion = np.full((len(table), 4), np.nan)
        turned = Rotation.from_euler("ZYX", turns[self.found])
        self._quaternion[self.found] = turned.as_quat(scalar_first=True)
        nothing = np.zeros(len(table))
        self._sigma_m = np.nan_to_num(table.numbers.get("sigma", nothing))
        self._sigma_rad = np.nan_to_num(table.numbers.get("sigma_yaw", nothing))

    def message(self, row: int, *, seq: int, stamp_ns: int) -> BlockPose:
        """Returns the message of one row."""
        if not self.found[row]:
            return BlockPose(stamp_ns=stamp_ns, seq=seq, reason="no pose in the source")
        (x, y), (qw, qx, qy, qz) = self.place_m[row].tolist(), self._quaternion[row].tolist()
        return BlockPose(
            stamp_ns=stamp_ns,
            seq=seq,
            x=x,
            y=y,
            z=float(self._z[row]),
            qw=qw,
            qx=qx,
            qy=qy,
            qz=qz,
            sigma_m=float(self._sigma_m[row]),
            sigma_rad=float(self._sigma_rad[row]),
            found=True,
        )


def block_of(table: Tracks, runs: tuple[Run, ...], corners: Corners | None = None) -> Poses:
    """Returns the block's track; `corners` are those that its poses come from.

    Raises:
        UserError: if the table has none, or a run lost the block throughout.
    """
    missing = [f"{name}_{unit}" for name, unit in zip(POSE, ("m", "m", "rad"), strict=True) if name not in table]
    if missing:
        raise UserError(
            f"Expected x_m, y_m and yaw_rad of the block's middle in the plate, or its mark's corners u0 to v3, in "
            f"{table.source}, missing are {', '.join(missing)}"
        )
    block = Poses(table, corners)
    for run in runs:
        if not block.found[run.rows].any():
            raise UserError(f"Expected the block in run {run.number} of {table.source}, found it in none of its rows")
    return block
