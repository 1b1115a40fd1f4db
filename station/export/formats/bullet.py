"""URDF for Bullet, one a body, and the few lines of Python that say what URDF cannot.

Bullet multiplies the two bodies' `lateral_friction`, so each gets the square root. Its anisotropic friction scales the
contact's tangents along the axes of a body's inertial frame, on either body; that frame is turned to the ellipse's
axis. A URDF has no word for it, nor for the friction cone without which Bullet's limit curve is a square: both are in
the loader. `<friction_anchor/>` keeps the object from creeping while it should rest.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from station.export.exported import (
    ExportedFile,
    NamedPair,
    hashed,
    measured_lines,
    number,
    unsupported_lines,
    xml_comment,
)
from station.export.materials import each_material
from station.export.measured import FixedIn, MeasuredPair
from station.export.scene import scene_of
from station.export.unsupported import always_unsupported, no_kinetic

NAME = "bullet"
HELP = "URDF of plate and object for Bullet, with a loader for the cone and anisotropic friction"

_VARIABLES = {"plate": "plate", "object": "object_"}
"""The bodies in the loader: `object` is a word of Python's."""


def export(pairs: Sequence[NamedPair]) -> tuple[ExportedFile, ...]:
    """Returns plate, object and loader for each pair."""
    return tuple(file for each in pairs for file in _files(each.stem, each.pair))


def _files(stem: str, pair: MeasuredPair) -> tuple[ExportedFile, ...]:
    unsupported = (*_yaw(pair), no_kinetic(pair, engine="Bullet"), *always_unsupported(pair))
    return (
        ExportedFile(f"{stem}_plate.urdf", _urdf(stem, pair, "plate", unsupported), pair.name, unsupported),
        ExportedFile(f"{stem}_object.urdf", _urdf(stem, pair, "object", unsupported), pair.name, unsupported),
        ExportedFile(f"{stem}_bullet.py", _loader(stem, pair, unsupported), pair.name, unsupported),
    )


def _yaw(pair: MeasuredPair) -> list[str]:
    if pair.isotropic:
        return []
    return [
        "URDF has no word for anisotropic friction: load both bodies with the loader beside them. The inertial frame "
        f"of the {pair.fixed_in}, whose pose Bullet reports, is turned by {math.degrees(pair.axis_rad):.1f} degrees "
        "about z against its own frame.",
    ]


def _urdf(stem: str, pair: MeasuredPair, body: FixedIn, unsupported: Sequence[str]) -> str:
    scene = scene_of(pair)
    about = [
        *measured_lines(pair),
        "Bullet reads the product of both bodies' lateral_friction, scaled along the axes by the loader.",
        *unsupported_lines(unsupported),
    ]
    plate = body == "plate"
    size = (scene.plate_side_m, scene.plate_side_m, scene.plate_thickness_m) if plate else (scene.side_m,) * 3
    height = number(-scene.plate_thickness_m / 2 if plate else scene.side_m / 2)
    yaw = 0.0 if pair.isotropic or body != pair.fixed_in else pair.axis_rad
    mass = number(0.0 if plate else scene.mass_kg)
    inertia = number(0.0 if plate else scene.inertia_kg_m2)
    box = f'<origin xyz="0 0 {height}"/><geometry><box size="{" ".join(map(number, size))}"/></geometry>'
    return f"""<?xml version="1.0"?>
{xml_comment(about)}
<robot name="{stem}_{body}">
  <link name="{body}">
    <contact><lateral_friction value="{number(each_material("product", pair.mu_1))}"/><friction_anchor/></contact>
    <inertial>
      <origin xyz="0 0 {height}" rpy="0 0 {number(yaw)}"/>
      <mass value="{mass}"/>
      <inertia ixx="{inertia}" iyy="{inertia}" izz="{inertia}" ixy="0" ixz="0" iyz="0"/>
    </inertial>
    <collision>{box}</collision>
    <visual>{box}</visual>
  </link>
</robot>
"""


def _loader(stem: str, pair: MeasuredPair, unsupported: Sequence[str]) -> str:
    about = [*measured_lines(pair), *unsupported_lines(unsupported)]
    ratio = number(pair.mu_2 / pair.mu_1)
    anisotropic = (
        ""
        if pair.isotropic
        else f"""
    # Along the axes of the inertial frame: mu_1 along x, mu_2 = {ratio} mu_1 along y.
    client.changeDynamics({_VARIABLES[pair.fixed_in]}, -1, anisotropicFriction=[1, {ratio}, 1])"""
    )
    return f'''{hashed(about)}
"""Loads {stem} into Bullet: friction as measured."""

from pathlib import Path


def load(client):
    """Loads plate and object with a client (pybullet or a BulletClient); gives their numbers."""
    folder = Path(__file__).parent
    inertia = client.URDF_USE_INERTIA_FROM_FILE
    plate = client.loadURDF(str(folder / "{stem}_plate.urdf"), useFixedBase=True, flags=inertia)
    object_ = client.loadURDF(str(folder / "{stem}_object.urdf"), flags=inertia)
    # Without it the limit curve is a square that holds up to 41 % more between its axes.
    client.setPhysicsEngineParameter(enableConeFriction=1){anisotropic}
    return plate, object_
'''
