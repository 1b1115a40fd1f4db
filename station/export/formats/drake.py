"""SDF for Drake: a rigid body's friction in `drake:proximity_properties`.

Drake combines harmonically, 2ab/(a + b), which gives back what both bodies have. In its discrete mode (a plant with a
time step) it reads mu_dynamic only, so both are the measured static coefficient. A box touches a plate in one point
there; the object has spheres at its corners, which hold it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from station.export.exported import ExportedFile, NamedPair, measured_lines, number, xml_comment
from station.export.materials import each_material
from station.export.measured import MeasuredPair
from station.export.scene import Scene, scene_of
from station.export.unsaid import always_unsaid, no_anisotropy

NAME = "drake"
HELP = "SDF for Drake: drake:mu_static and mu_dynamic (harmonic mean), an object on four feet"
_FOOT = 0.01
"""Radius of a foot over the cube's side: small, so that they stand where the cube's corners are."""


def export(pairs: Sequence[NamedPair]) -> tuple[ExportedFile, ...]:
    """A world a pair."""
    return tuple(_file(each.stem, each.pair) for each in pairs)


def _file(stem: str, pair: MeasuredPair) -> ExportedFile:
    unsaid = (*no_anisotropy(pair, engine="Drake"), _kinetic(pair), *always_unsaid(pair))
    return ExportedFile(f"{stem}.drake.sdf", _world(stem, pair, unsaid), pair.name, unsaid)


def _kinetic(pair: MeasuredPair) -> str:
    dynamic = (
        "kinetic friction was not measured"
        if math.isnan(pair.kinetic_ratio)
        else f"the measured kinetic one is {number(pair.mu * pair.kinetic_ratio)}"
    )
    return (
        "Drake's discrete mode ignores mu_static and reads mu_dynamic at rest, too: both are the static coefficient "
        f"here ({dynamic}). In the continuous mode set mu_dynamic to the kinetic one."
    )


def _world(stem: str, pair: MeasuredPair, unsaid: Sequence[str]) -> str:
    scene = scene_of(pair)
    about = [
        *measured_lines(pair),
        "Call plant.set_discrete_contact_approximation(DiscreteContactApproximation.kSap) before Finalize: with the "
        "default (lagged) the object starts about a degree early.",
        *(f"NOT SAID: {text}" for text in unsaid),
    ]
    friction = _friction(each_material("harmonic", pair.mu))
    plate = " ".join(map(number, (scene.plate_side_m, scene.plate_side_m, scene.plate_thickness_m)))
    inertia, middle = number(scene.inertia_kg_m2), number(scene.side_m / 2)
    return f"""<?xml version="1.0"?>
{xml_comment(about)}
<sdf version="1.9" xmlns:drake="http://drake.mit.edu">
  <world name="{stem}">
    <model name="plate">
      <static>true</static>
      <link name="plate">
        <collision name="plate">
          <pose>0 0 {number(-scene.plate_thickness_m / 2)} 0 0 0</pose>
          <geometry><box><size>{plate}</size></box></geometry>
          {friction}
        </collision>
        <visual name="plate">
          <pose>0 0 {number(-scene.plate_thickness_m / 2)} 0 0 0</pose>
          <geometry><box><size>{plate}</size></box></geometry>
        </visual>
      </link>
    </model>
    <model name="object">
      <link name="object">
        <inertial>
          <pose>0 0 {middle} 0 0 0</pose>
          <mass>{number(scene.mass_kg)}</mass>
          <inertia>
            <ixx>{inertia}</ixx><iyy>{inertia}</iyy><izz>{inertia}</izz><ixy>0</ixy><ixz>0</ixz><iyz>0</iyz>
          </inertia>
        </inertial>
{_feet(scene, friction)}
        <visual name="object">
          <pose>0 0 {middle} 0 0 0</pose>
          <geometry><box><size>{" ".join([number(scene.side_m)] * 3)}</size></box></geometry>
        </visual>
      </link>
    </model>
  </world>
</sdf>
"""


def _feet(scene: Scene, friction: str) -> str:
    radius = _FOOT * scene.side_m
    out = scene.side_m / 2 - radius
    return "\n".join(
        f"""        <collision name="foot_{index}">
          <pose>{number(x * out)} {number(y * out)} {number(radius)} 0 0 0</pose>
          <geometry><sphere><radius>{number(radius)}</radius></sphere></geometry>
          {friction}
        </collision>"""
        for index, (x, y) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1)))
    )


def _friction(mu: float) -> str:
    return (
        f"<drake:proximity_properties><drake:mu_static>{number(mu)}</drake:mu_static>"
        f"<drake:mu_dynamic>{number(mu)}</drake:mu_dynamic></drake:proximity_properties>"
    )
