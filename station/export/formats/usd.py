"""USD physics as text (.usda): PhysicsMaterialAPI with static and dynamic friction, combined by their average.

Both materials have the pair's coefficients, so their average is the pair's. PhysX is asked for the average by name.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from station.export.exported import ExportedFile, NamedPair, hashed, measured_lines, number, unsupported_lines
from station.export.materials import each_material
from station.export.measured import MeasuredPair
from station.export.scene import scene_of
from station.export.unsupported import always_unsupported, no_anisotropy

NAME = "usd"
HELP = "USD physics (.usda): static and dynamic friction of two materials (average), no directions"


def export(pairs: Sequence[NamedPair]) -> tuple[ExportedFile, ...]:
    """Returns a stage for each pair."""
    return tuple(_file(each.stem, each.pair) for each in pairs)


def _file(stem: str, pair: MeasuredPair) -> ExportedFile:
    unsupported = (*no_anisotropy(pair, engine="USD physics"), *_kinetic(pair), *always_unsupported(pair))
    return ExportedFile(f"{stem}.usda", _stage(pair, unsupported), pair.name, unsupported)


def _kinetic(pair: MeasuredPair) -> list[str]:
    if not math.isnan(pair.kinetic_ratio):
        return [
            "With dynamicFriction below staticFriction a cube in PhysX 5 starts early: by up to 1 degree at a "
            "ratio of 0.95, by 2 to 4 degrees at 0.8 and below. Where the onset matters more than the slide, make "
            "dynamicFriction the static one."
        ]
    return ["Kinetic friction was not measured: dynamicFriction is the static coefficient."]


def _stage(pair: MeasuredPair, unsupported: Sequence[str]) -> str:
    scene = scene_of(pair)
    about = [*measured_lines(pair), *unsupported_lines(unsupported)]
    kinetic = pair.mu * (1.0 if math.isnan(pair.kinetic_ratio) else pair.kinetic_ratio)
    friction = (each_material("average", pair.mu), each_material("average", kinetic))
    wide, thick, side = scene.plate_side_m, scene.plate_thickness_m, scene.side_m
    return f"""#usda 1.0
(
    defaultPrim = "World"
    metersPerUnit = 1
    kilogramsPerUnit = 1
    upAxis = "Z"
)

{hashed(about)}

def Xform "World"
{{
    def PhysicsScene "Physics"
    {{
        vector3f physics:gravityDirection = (0, 0, -1)
        float physics:gravityMagnitude = 9.81
    }}
{_material("PlateMaterial", friction)}
{_material("ObjectMaterial", friction)}

    def Cube "Plate" (prepend apiSchemas = ["PhysicsCollisionAPI", "MaterialBindingAPI"])
    {{
        double size = 1
        rel material:binding:physics = </World/PlateMaterial>
        double3 xformOp:translate = (0, 0, {number(-thick / 2)})
        float3 xformOp:scale = ({number(wide)}, {number(wide)}, {number(thick)})
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]
    }}

    def Cube "Object" (
        prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI", "PhysicsCollisionAPI", "MaterialBindingAPI"]
    )
    {{
        double size = 1
        float physics:mass = {number(scene.mass_kg)}
        rel material:binding:physics = </World/ObjectMaterial>
        double3 xformOp:translate = (0, 0, {number(side / 2)})
        float3 xformOp:scale = ({number(side)}, {number(side)}, {number(side)})
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]
    }}
}}
"""


def _material(name: str, friction: tuple[float, float]) -> str:
    return f"""
    def Material "{name}" (prepend apiSchemas = ["PhysicsMaterialAPI", "PhysxMaterialAPI"])
    {{
        float physics:staticFriction = {number(friction[0])}
        float physics:dynamicFriction = {number(friction[1])}
        float physics:restitution = 0
        uniform token physxMaterial:frictionCombineMode = "average"
    }}"""
