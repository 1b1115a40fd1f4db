"""A rig's description in URDF (http://wiki.ros.org/urdf/XML), so that viewers draw arm, plate and block by themselves.

Its links have the names of the frames in `shared.frames` and `station.rig.placed_arm`. Viewers take only the shapes
from it: where they are, the recorded transforms say.
"""

from __future__ import annotations

import math
from dataclasses import replace
from xml.etree import ElementTree as xml

from shared.frames import BLOCK, PLATFORM, WORLD
from shared.rig import RigConfig
from station.rig import looks
from station.rig.arm_model import Capsule, Vector
from station.rig.placed_arm import BASE, PlacedArm

_ORIGIN = (0.0, 0.0, 0.0)
_MARK_SHARE = 0.9
"""The share of the block's side that its mark takes, so that the block's rim is seen around it."""


def description(rig: RigConfig, arm: PlacedArm) -> str:
    """Returns the URDF of arm, plate with its foam, and block. Lengths are in metres."""
    robot = xml.Element("robot", name=rig.id)
    _link(robot, WORLD, "")
    _capsule(_link(robot, BASE, WORLD), arm.model.base_capsule, looks.ARM_DARK)
    parent = BASE
    for number, joint in enumerate(arm.model.joints):
        link, shade = _link(robot, joint.name, parent), looks.ARM_DARK if number % 2 else looks.ARM
        if joint is arm.model.joints[-1]:
            _cylinder(link, _below_the_plate(joint.link_capsule, arm.model.flange_xyz_m), shade)
        else:
            _capsule(link, joint.link_capsule, shade)
        parent = joint.name
    _plate(_link(robot, PLATFORM, WORLD), rig)
    _block(_link(robot, BLOCK, PLATFORM), rig)
    return xml.tostring(robot, encoding="unicode")


def _below_the_plate(capsule: Capsule, flange_m: Vector) -> Capsule:
    """Returns the last link up to the plate's underside; a capsule's round end would look out of the plate."""
    share = 1.0 - looks.PLATE_THICKNESS_M / max(math.dist(capsule.from_m, flange_m), looks.PLATE_THICKNESS_M)
    x, y, z = (a + share * (b - a) for a, b in zip(capsule.from_m, flange_m, strict=True))
    return replace(capsule, to_m=(x, y, z))


def _plate(link: xml.Element, rig: RigConfig) -> None:
    """Adds the plate, whose top is the plane z = 0, and four strips of foam; the opening is drawn as a square."""
    side, thickness, height = rig.plate.side_m, looks.PLATE_THICKNESS_M, looks.FOAM_HEIGHT_M
    _box(link, (side, side, thickness), (0.0, 0.0, -0.5 * thickness), looks.PLATE)
    width = 0.5 * (side - rig.plate.opening_m)
    if width <= 0:
        return
    middle, top = 0.5 * (side - width), 0.5 * height
    for sign in (-1.0, 1.0):
        _box(link, (side, width, height), (0.0, sign * middle, top), looks.FOAM)
        _box(link, (width, side - 2.0 * width, height), (sign * middle, 0.0, top), looks.FOAM)


def _block(link: xml.Element, rig: RigConfig) -> None:
    """Adds the block about its middle, with its mark as thin as paper."""
    length, width, height = rig.block.size_m
    _box(link, (length, width, height), _ORIGIN, looks.BLOCK)
    mark = (_MARK_SHARE * length, _MARK_SHARE * width, 0.02 * height)
    _box(link, mark, (0.0, 0.0, 0.5 * height), looks.BLOCK_TOP)


def _link(robot: xml.Element, name: str, parent: str) -> xml.Element:
    link = xml.SubElement(robot, "link", name=name)
    if parent:
        joint = xml.SubElement(robot, "joint", name=f"{parent}_{name}", type="floating")
        xml.SubElement(joint, "parent", link=parent)
        xml.SubElement(joint, "child", link=name)
    return link


def _capsule(link: xml.Element, capsule: Capsule, colour: looks.Colour) -> None:
    """Adds a link's rough shape: a cylinder with a ball at each end.

    URDF has no capsule. Rerun 0.41 draws one, but begins it in the middle, so that the arm looks torn apart.
    """
    _cylinder(link, capsule, colour)
    for end in (capsule.from_m, capsule.to_m):
        xml.SubElement(_visual(link, end, _ORIGIN, colour), "sphere", radius=f"{capsule.radius_m:g}")


def _cylinder(link: xml.Element, capsule: Capsule, colour: looks.Colour) -> None:
    start, end = capsule.from_m, capsule.to_m
    x, y, z = (b - a for a, b in zip(start, end, strict=True))
    length = math.dist(start, end)
    middle = (0.5 * (start[0] + end[0]), 0.5 * (start[1] + end[1]), 0.5 * (start[2] + end[2]))
    # URDF lays a cylinder along its z: pitch leans z away from upright, yaw turns it towards the other end.
    turned = (0.0, math.atan2(math.hypot(x, y), z), math.atan2(y, x))
    geometry = _visual(link, middle, turned, colour)
    xml.SubElement(geometry, "cylinder", radius=f"{capsule.radius_m:g}", length=f"{length:.6g}")


def _box(link: xml.Element, size_m: Vector, at_m: Vector, colour: looks.Colour) -> None:
    xml.SubElement(_visual(link, at_m, _ORIGIN, colour), "box", size=_numbers(size_m))


def _visual(link: xml.Element, at_m: Vector, rpy_rad: Vector, colour: looks.Colour) -> xml.Element:
    """Returns a new visual of a link; gives its geometry, still empty."""
    visual = xml.SubElement(link, "visual")
    xml.SubElement(visual, "origin", xyz=_numbers(at_m), rpy=_numbers(rpy_rad))
    geometry = xml.SubElement(visual, "geometry")
    material = xml.SubElement(visual, "material", name="rgb_{:02x}{:02x}{:02x}".format(*colour))
    red, green, blue = (part / 255.0 for part in colour)
    xml.SubElement(material, "color", rgba=_numbers((red, green, blue)) + " 1")
    return geometry


def _numbers(values: Vector) -> str:
    return " ".join(f"{value:.6g}" for value in values)
