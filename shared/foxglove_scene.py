"""Foxglove's bodies in a scene, as far as a rig is made of them; lengths are in metres.

The published `SceneEntity` has further fields (arrows, lines, triangles, texts, models), and `SceneUpdate` has
deletions. A reader takes what a schema lacks for empty.
"""

from __future__ import annotations

from dataclasses import dataclass

from shared.foxglove import Duration, FoxgloveMessage, Pose, Timestamp, Vector3, numbered
from shared.foxglove_annotations import Color, KeyValuePair


@dataclass(frozen=True, slots=True)
class CubePrimitive(FoxgloveMessage):
    """A box about its pose; `size` is its length along each axis."""

    pose: Pose = Pose()
    size: Vector3 = Vector3()
    color: Color = Color()


@dataclass(frozen=True, slots=True)
class SpherePrimitive(FoxgloveMessage):
    """A ball or ellipsoid about its pose; `size` is its diameter along each axis."""

    pose: Pose = Pose()
    size: Vector3 = Vector3()
    color: Color = Color()


@dataclass(frozen=True, slots=True)
class CylinderPrimitive(FoxgloveMessage):
    """A cylinder about its pose, along z; the scales (0 to 1) narrow its ends."""

    pose: Pose = Pose()
    size: Vector3 = Vector3()
    bottom_scale: float = 1.0
    top_scale: float = 1.0
    color: Color = Color()


@dataclass(frozen=True, slots=True)
class SceneEntity(FoxgloveMessage):
    """Bodies in one frame, which they follow if `frame_locked`; a `lifetime` of zero is for good."""

    timestamp: Timestamp = Timestamp()
    frame_id: str = ""
    id: str = ""
    lifetime: Duration = Duration()
    frame_locked: bool = False
    metadata: tuple[KeyValuePair, ...] = ()
    cubes: tuple[CubePrimitive, ...] = numbered(8, ())
    spheres: tuple[SpherePrimitive, ...] = numbered(9, ())
    cylinders: tuple[CylinderPrimitive, ...] = numbered(10, ())


@dataclass(frozen=True, slots=True)
class SceneUpdate(FoxgloveMessage):
    """Bodies that are new, or take the place of those of the same id."""

    entities: tuple[SceneEntity, ...] = numbered(2, ())
