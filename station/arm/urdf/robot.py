"""The links and joints that a URDF describes, checked; positions in metres, angles in radians, as URDF has them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar
from xml.etree.ElementTree import Element

import numpy as np

from shared.errors import UserError
from shared.possible import LARGEST
from station.arm.urdf.reading import read_bounded, read_xml
from station.rig.arm_model import Array, Vector, transform

_MOST_BYTES = 8_000_000  # the largest humanoids' files have a few hundred thousand
_MOST_PARTS = 5_000
_MOVING = ("revolute", "continuous")
KINDS = (*_MOVING, "fixed", "prismatic", "floating", "planar")


@dataclass(frozen=True, kw_only=True)
class Shape:
    """One <geometry>: its element (box, cylinder, sphere, mesh) and link_from_shape (4, 4)."""

    element: Element
    link_from_shape: Array


@dataclass(frozen=True, kw_only=True)
class Link:
    """A link: its mass (None where the file states none) and its geometry for collisions, else for the eye."""

    name: str
    mass_kg: float | None
    shapes: tuple[Shape, ...]


@dataclass(frozen=True, kw_only=True)
class UrdfJoint:
    """A joint; limits are None where the file states none (or 0, which tools write for "unknown")."""

    name: str
    kind: str
    parent: str
    child: str
    xyz_m: Vector
    rpy_rad: Vector
    axis: Vector
    lower_rad: float | None
    upper_rad: float | None
    max_velocity_rad_s: float | None
    max_effort_nm: float | None
    mimics: str

    @property
    def moves(self) -> bool:
        """True if it is no fixed joint."""
        return self.kind != "fixed"

    @property
    def parent_from_child(self) -> Array:
        """The transform (4, 4) at the angle 0."""
        return transform(self.xyz_m, self.rpy_rad)


@dataclass(frozen=True, kw_only=True)
class Robot:
    """A robot: `links` by name, `joints` by the name of the link that each carries; the root is carried by none."""

    name: str
    root: str
    links: dict[str, Link]
    joints: dict[str, UrdfJoint]


Part = TypeVar("Part", Link, UrdfJoint)


def read_robot(path: Path) -> Robot:
    """Reads a URDF file.

    Raises:
        UserError: naming what is wrong with it.
    """
    root = read_xml(read_bounded(path, most_bytes=_MOST_BYTES, what="a URDF"), what=str(path))
    if root.tag != "robot":
        hint = "; export it as URDF" if root.tag in ("sdf", "mujoco") else ""
        raise UserError(f"Expected a URDF, whose outermost element is <robot>, but {path} has <{root.tag}>{hint}")
    if any(child.tag.startswith("xacro:") for child in root):
        raise UserError(f"Expected a finished URDF, but {path} is a xacro: run `xacro {path.name} > robot.urdf` first")
    if len(root) > _MOST_PARTS:
        raise UserError(f"Expected at most {_MOST_PARTS} parts of a robot, but {path} has {len(root)}")
    links = _unique([_link(found) for found in root.findall("link")], what="link")
    joints = _unique([_joint(found) for found in root.findall("joint")], what="joint")
    return _connected(root.get("name") or path.stem, links, joints)


def _unique(parts: Iterable[Part], *, what: str) -> dict[str, Part]:
    found: dict[str, Part] = {}
    for part in parts:
        if part.name in found:
            raise UserError(f"Expected every {what} of the URDF once, but {part.name!r} comes twice")
        found[part.name] = part
    return found


def _connected(name: str, links: dict[str, Link], joints: dict[str, UrdfJoint]) -> Robot:
    carried: dict[str, UrdfJoint] = {}
    for joint in joints.values():
        for end in (joint.parent, joint.child):
            if end not in links:
                raise UserError(f"The joint {joint.name!r} of the URDF names the link {end!r}, which it does not have")
        if joint.child in carried:
            raise UserError(f"Expected every link of the URDF on one joint, but {joint.child!r} hangs on two")
        carried[joint.child] = joint
    roots = [link for link in links if link not in carried]
    if len(roots) != 1:
        listed = ", ".join(map(repr, roots[:5])) or "none"
        raise UserError(f"Expected one link of the URDF that hangs on no joint, found {len(roots)}: {listed}")
    return Robot(name=name, root=roots[0], links=links, joints=carried)


def _link(element: Element) -> Link:
    name = _name(element)
    mass = element.find("inertial/mass")
    parts = element.findall("collision") or element.findall("visual")
    shapes = [(part, shape) for part in parts for shape in part.findall("geometry/*")]
    return Link(
        name=name,
        mass_kg=_number(mass, "value", where=f"link {name!r}") if mass is not None else None,
        shapes=tuple(
            Shape(element=shape, link_from_shape=transform(*_origin(part, f"link {name!r}"))) for part, shape in shapes
        ),
    )


def _joint(element: Element) -> UrdfJoint:
    name = _name(element)
    where, kind = f"joint {name!r}", element.get("type", "")
    if kind not in KINDS:
        raise UserError(f"Expected a type of {where} in the URDF ({', '.join(KINDS)}), got {kind!r}")
    limit, axis, mimic = element.find("limit"), element.find("axis"), element.find("mimic")
    xyz, rpy = _origin(element, where)
    return UrdfJoint(
        name=name, kind=kind, parent=_end(element, "parent", where), child=_end(element, "child", where),
        xyz_m=xyz, rpy_rad=rpy, axis=_direction(axis, where),
        lower_rad=_number(limit, "lower", where=where) if kind == "revolute" else None,
        upper_rad=_number(limit, "upper", where=where) if kind == "revolute" else None,
        max_velocity_rad_s=_number(limit, "velocity", where=where) or None,
        max_effort_nm=_number(limit, "effort", where=where) or None,
        mimics="" if mimic is None else mimic.get("joint", "another"),
    )  # fmt: skip


def _name(element: Element) -> str:
    name = element.get("name", "")
    if not name or not name.isprintable():
        raise UserError(f"Expected a name of printable letters for each {element.tag} of the URDF, got {name!r}")
    return name


def _end(element: Element, tag: str, where: str) -> str:
    end = element.find(tag)
    if end is None or not end.get("link"):
        raise UserError(f'Expected <{tag} link="..."/> in the {where} of the URDF')
    return end.get("link", "")


def _origin(element: Element, where: str) -> tuple[Vector, Vector]:
    origin = element.find("origin")
    return vector(origin, "xyz", where=where), vector(origin, "rpy", where=where)


def _direction(axis: Element | None, where: str) -> Vector:
    if axis is None:
        return (1.0, 0.0, 0.0)  # URDF's rule
    found = vector(axis, "xyz", where=where)
    length = float(np.linalg.norm(found))
    if not length > 0:
        raise UserError(f"Expected a direction as the axis of the {where} in the URDF, got {axis.get('xyz')!r}")
    return (found[0] / length, found[1] / length, found[2] / length)


def _number(element: Element | None, key: str, *, where: str) -> float | None:
    if element is None or element.get(key) is None:
        return None
    return numbers(element, key, count=1, where=where, most=math.inf)[0]


def vector(element: Element | None, key: str, *, where: str, default: Vector = (0.0, 0.0, 0.0)) -> Vector:
    """Returns three numbers of an attribute; the default where there is none.

    Raises:
        UserError: if it holds something else.
    """
    if element is None or element.get(key) is None:
        return default
    x, y, z = numbers(element, key, count=3, where=where)
    return (x, y, z)


def numbers(element: Element, key: str, *, count: int, where: str, most: float = LARGEST) -> list[float]:
    """Returns the finite numbers of an attribute; limits of joints may be beyond all rigs, lengths may not.

    Raises:
        UserError: if it is missing, or holds anything but that many of at most `most`, without their signs.
    """
    text = element.get(key, "")
    try:
        found = [float(word) for word in text.split()]
    except ValueError:
        found = []
    if len(found) != count or not all(math.isfinite(value) and abs(value) <= most for value in found):
        bound = "" if math.isinf(most) else f", none beyond {most:g}"
        wanted = "a finite number" if count == 1 else f"{count} finite numbers"
        raise UserError(f"Expected {wanted} as {key} of the {where} in the URDF{bound}, got {text[:80]!r}")
    return found
