"""The smallest capsule round a cloud, whatever its shape and however many points it has."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from shared.errors import UserError
from station.arm.urdf.capsule import convex_corners, enclosing_capsule
from station.arm.urdf.chain import chain_of
from station.arm.urdf.model import draft
from station.arm.urdf.robot import read_robot
from station.arm.urdf.shapes import Meshes
from station.rig.arm_model import Array, Capsule


def ball(count: int) -> Array:
    """Points of a sphere of 0.1 m, all of them corners of their hull."""
    directions = np.random.default_rng(1).normal(size=(count, 3))
    return 0.1 * directions / np.linalg.norm(directions, axis=1)[:, None]


def holds(capsule: Capsule, points: Array) -> bool:
    first, last = np.array(capsule.from_m), np.array(capsule.to_m)
    share = np.clip((points - first) @ (last - first) / float((last - first) @ (last - first)), 0, 1)
    return bool((np.linalg.norm(points - first - share[:, None] * (last - first), axis=1) <= capsule.radius_m).all())


def test_a_hull_of_many_corners_takes_the_memory_of_its_points() -> None:
    """The decomposition of 100 000 points was one of 100 000 by 100 000 numbers: 75 GiB, and a traceback."""
    points = ball(100_000)
    assert holds(enclosing_capsule(points), points)


def test_a_flat_cover_of_many_points_is_its_outline() -> None:
    plane = np.random.default_rng(2).uniform(-0.1, 0.1, size=(100_000, 2))
    points = np.column_stack([plane, np.zeros(len(plane))])
    assert len(convex_corners(points)) < 100
    assert holds(enclosing_capsule(points), points)


def test_a_straight_rod_is_its_ends() -> None:
    points = np.linspace(0, 1, 1000)[:, None] * np.array([0.0, 0.0, 0.3])
    assert sorted(convex_corners(points)[:, 2].tolist()) == pytest.approx([0.0, 0.3])
    assert convex_corners(points[:1]).tolist() == [[0, 0, 0], [0, 0, 0]]


def test_a_hull_too_fine_to_be_searched_is_refused(tmp_path: Path) -> None:
    """A search for the hull of 300 000 corners took 160 s and 1.3 GB."""
    root = tmp_path / "ball.urdf"
    root.write_text(
        '<robot name="r"><link name="foot"><collision><geometry><mesh filename="ball.stl"/></geometry></collision>'
        '</link><link name="plate"/>'
        '<joint name="j" type="continuous"><parent link="foot"/><child link="plate"/></joint></robot>'
    )
    faces = np.zeros((6_668, 12), dtype="<f4")
    faces[:, 3:] = ball(20_004).reshape(-1, 9)
    records = b"".join(face.tobytes() + bytes(2) for face in faces)
    (tmp_path / "ball.stl").write_bytes(bytes(80) + struct.pack("<I", len(faces)) + records)
    with pytest.raises(UserError, match="at most 20000 corners as link foot, found 20004; simplify it"):
        draft(chain_of(read_robot(root)), Meshes(folder=tmp_path), name="r", source="r")
