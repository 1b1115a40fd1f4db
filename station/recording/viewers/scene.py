"""Arm, plate and block as Foxglove's bodies, once, made of the rig's URDF: each body follows its frame from then on."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import ClassVar
from xml.etree import ElementTree as xml

from shared.foxglove import FrameTransforms, Pose, Quaternion, Timestamp, Vector3
from shared.foxglove_annotations import Color
from shared.foxglove_scene import CubePrimitive, CylinderPrimitive, SceneEntity, SceneUpdate, SpherePrimitive
from shared.geometry import Array, quaternion_from_matrix
from shared.rig import RigConfig
from station.recording.viewers.extra import Extra, Handler, foxglove
from station.recording.viewers.placing import Placing
from station.rig.arm_model import Vector, transform
from station.rig.description import description
from station.rig.placed_arm import PlacedArm

TOPIC = "scene"
_Body = CubePrimitive | CylinderPrimitive | SpherePrimitive


class Scene:
    """Writes arm, plate and block as Foxglove's bodies once everything has been placed."""

    topics: ClassVar[frozenset[str]] = frozenset({TOPIC})

    def __init__(self, rig: RigConfig, arm: PlacedArm) -> None:
        self._rig, self._arm, self._placing = rig, arm, Placing(arm)

    def handlers(self) -> Mapping[str, Handler]:
        """Returns the handlers of joints and transforms, which tell when everything has been placed."""
        return {"arm/joints": self._placing.take_joints, "tf": self._on_transforms}

    def _on_transforms(self, message: FrameTransforms, stamp_ns: int) -> Iterable[Extra]:
        if self._placing.just_done(message):
            robot = xml.fromstring(description(self._rig, self._arm))
            timestamp = Timestamp.from_ns(stamp_ns)
            entities = (_entity(link, timestamp) for link in robot.iter("link"))
            yield foxglove(TOPIC, SceneUpdate(tuple(entity for entity in entities if entity is not None)))


def _entity(link: xml.Element, timestamp: Timestamp) -> SceneEntity | None:
    """Returns the bodies of a link; None for one without any, such as the world."""
    bodies = [_body(visual) for visual in link.iter("visual")]
    if not bodies:
        return None
    return SceneEntity(
        timestamp,
        frame_id=link.attrib["name"],
        id=link.attrib["name"],
        frame_locked=True,
        cubes=tuple(body for body in bodies if isinstance(body, CubePrimitive)),
        spheres=tuple(body for body in bodies if isinstance(body, SpherePrimitive)),
        cylinders=tuple(body for body in bodies if isinstance(body, CylinderPrimitive)),
    )


def _body(visual: xml.Element) -> _Body:
    origin, color = _one(visual, "origin").attrib, _one(visual, "material/color").attrib
    frame = transform(_vector(origin["xyz"]), _vector(origin["rpy"]))
    shape = _one(visual, "geometry")[0]
    return _SHAPES[shape.tag](shape.attrib, frame, Color(*_numbers(color["rgba"])))


def _box(sizes: Mapping[str, str], frame: Array, color: Color) -> _Body:
    return CubePrimitive(_pose(frame), Vector3(*_vector(sizes["size"])), color)


def _cylinder(sizes: Mapping[str, str], frame: Array, color: Color) -> _Body:
    wide = 2.0 * float(sizes["radius"])
    return CylinderPrimitive(_pose(frame), Vector3(wide, wide, float(sizes["length"])), color=color)


def _sphere(sizes: Mapping[str, str], frame: Array, color: Color) -> _Body:
    wide = 2.0 * float(sizes["radius"])
    return SpherePrimitive(_pose(frame), Vector3(wide, wide, wide), color)


_SHAPES = {"box": _box, "cylinder": _cylinder, "sphere": _sphere}


def _pose(frame: Array) -> Pose:
    w, x, y, z = quaternion_from_matrix(frame[:3, :3])
    return Pose(Vector3(*frame[:3, 3].tolist()), Quaternion(x, y, z, w))


def _one(element: xml.Element, path: str) -> xml.Element:
    found = element.find(path)
    assert found is not None, path
    return found


def _vector(text: str) -> Vector:
    x, y, z = _numbers(text)
    return x, y, z


def _numbers(text: str) -> list[float]:
    return [float(word) for word in text.split()]
