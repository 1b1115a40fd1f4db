"""The fixed shapes of the scene as Rerun archetypes."""

from __future__ import annotations

import math

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from scipy.spatial import Delaunay

from shared.geometry import Array, quaternion_from_matrix
from station.rig.arm_model import ArmModel, Capsule
from station.rig.outline import inside_by_m
from station.view import colours
from station.view.setup import Setup

_RING, _PIECES = 64, 160


def plate(setup: Setup) -> rr.Boxes3D:
    """Returns the plate; its top is the plane z = 0 of the plate frame."""
    half = 0.5 * setup.plate_side_m
    return rr.Boxes3D(
        centers=[[0.0, 0.0, -0.5 * setup.plate_thickness_m]],
        half_sizes=[[half, half, 0.5 * setup.plate_thickness_m]],
        colors=[colours.PLATE],
        fill_mode="solid",
    )


def foam(setup: Setup, *, opening_m: float) -> rr.Mesh3D:
    """Gives the foam border: a square frame with a hole, round with the diameter `opening_m` or of the setup's outline.

    The top is triangulated between points along both outlines, so near to each other that every piece of an outline is
    a side of a triangle (Delaunay); the triangles in the hole are left out.
    """
    half = 0.5 * setup.plate_side_m
    hole = np.array(setup.opening_outline_m) if setup.opening_outline_m else _ring(0.5 * opening_m)
    loops = [_divided(hole), _divided(half * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]))]
    xy = np.concatenate(loops)
    triangles = Delaunay(xy).simplices
    top = triangles[inside_by_m(hole, xy[triangles].mean(axis=1)) < 0.0]
    vertices = [np.column_stack([xy, np.full(len(xy), z)]) for z in (setup.foam_height_m, 0.0)]
    walls = [_wall(first, len(loop), len(xy)) for first, loop in zip((0, len(loops[0])), loops, strict=True)]
    return rr.Mesh3D(
        vertex_positions=np.concatenate(vertices),
        triangle_indices=np.concatenate([top, *walls]),
        vertex_colors=np.tile((*colours.FOAM, 255), (2 * len(xy), 1)),
    )


def _ring(radius_m: float) -> Array:
    """Returns a circle's outline (n, 2), m."""
    angle = np.linspace(0.0, 2 * math.pi, _RING, endpoint=False)
    return radius_m * np.column_stack([np.cos(angle), np.sin(angle)])


def _divided(outline_m: Array) -> Array:
    """Returns the outline (k, 2), m, with more corners (n, 2) along its sides, at most a _PIECES-th of it apart."""
    after = np.roll(outline_m, -1, axis=0)
    lengths = np.linalg.norm(after - outline_m, axis=1)
    counts = np.maximum(np.ceil(_PIECES * lengths / lengths.sum()).astype(int), 1)
    sides = zip(outline_m, after, counts.tolist(), strict=True)
    return np.concatenate([np.linspace(begin, end, count, endpoint=False) for begin, end, count in sides])


def _wall(first: int, count: int, below: int) -> NDArray[np.int64]:
    """Returns triangles (2 count, 3) between a loop of vertices from `first` on and the one `below` places later."""
    here = first + np.arange(count)
    there = first + (np.arange(count) + 1) % count
    return np.concatenate(
        [np.column_stack([here, there, here + below]), np.column_stack([there, there + below, here + below])]
    )


def block(setup: Setup) -> rr.Boxes3D:
    """Returns the block about its middle."""
    return rr.Boxes3D(
        half_sizes=[[0.5 * size for size in setup.block_size_m]], colors=[colours.BLOCK], fill_mode="solid"
    )


def mark(setup: Setup) -> rr.Boxes3D:
    """Returns the dark mark on the block's top, as thin as paper; it lets the block's rim be seen."""
    half_x, half_y = 0.5 * setup.mark_side_m, 0.5 * setup.mark_side_m * setup.mark_aspect
    top = 0.5 * setup.block_size_m[2]
    return rr.Boxes3D(
        centers=[[0.0, 0.0, top]],
        half_sizes=[[0.9 * half_x, 0.9 * half_y, 0.02 * top]],
        colors=[colours.BLOCK_TOP],
        fill_mode="solid",
    )


class ArmShape:
    """The arm's capsules: shape once, then a pose for each set of joint angles."""

    def __init__(self, model: ArmModel) -> None:
        capsules = (model.base_capsule, *(joint.link_capsule for joint in model.joints))
        self._link_from_capsule = np.array([_along(capsule) for capsule in capsules])
        self._lengths = [math.dist(capsule.from_m, capsule.to_m) for capsule in capsules]
        self._radii = [capsule.radius_m for capsule in capsules]

    def shape(self) -> rr.Capsules3D:
        """Returns lengths, radii and colours, without places."""
        shades = [colours.ARM_DARK if i % 2 == 0 else colours.ARM for i in range(len(self._lengths))]
        return rr.Capsules3D.from_fields(lengths=self._lengths, radii=self._radii, colors=shades, fill_mode="solid")

    def pose(self, world_from_link: Array) -> rr.Capsules3D:
        """Returns places for world_from_base and every one of n links.

        `world_from_link` (k, 4, 4), with k = n + 1, has the base first; its shifts are in m.
        """
        poses = world_from_link @ self._link_from_capsule
        quaternions = [quaternion_from_matrix(pose[:3, :3]) for pose in poses]
        return rr.Capsules3D.from_fields(
            translations=poses[:, :3, 3], quaternions=[rr.Quaternion(xyzw=[x, y, z, w]) for w, x, y, z in quaternions]
        )


def _along(capsule: Capsule) -> NDArray[np.float64]:
    """Returns link_from_capsule (4, 4): origin at one end, z towards the other."""
    start, end = np.array(capsule.from_m), np.array(capsule.to_m)
    length = float(np.linalg.norm(end - start))
    z = (end - start) / length if length > 0 else np.array([0.0, 0.0, 1.0])
    aside = np.array([1.0, 0.0, 0.0]) if abs(z[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    x = np.cross(aside, z)
    x /= np.linalg.norm(x)
    result = np.eye(4)
    result[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    result[:3, 3] = start
    return result
