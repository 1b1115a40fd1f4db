"""SDF for Drake: a rigid body's friction in `drake:proximity_properties`.

Drake combines harmonically, 2ab/(a + b), which gives back what both bodies have. In its discrete mode (a plant with a
time step) it reads mu_dynamic only, so both are the measured static coefficient. A box touches a plate in one point
there; the object has spheres at its corners, which hold it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from station.export import sdf
from station.export.exported import ExportedFile, NamedPair, measured_lines, number, unsupported_lines
from station.export.materials import each_material
from station.export.measured import MeasuredPair
from station.export.scene import Scene, scene_of
from station.export.unsupported import always_unsupported, no_anisotropy

NAME = "drake"
HELP = "SDF for Drake: drake:mu_static and mu_dynamic (harmonic mean), an object on four feet"
_FOOT = 0.01
"""Radius of a foot over the cube's side: small, so that they stand where the cube's corners are."""


def export(pairs: Sequence[NamedPair]) -> tuple[ExportedFile, ...]:
    """Returns a world for each pair."""
    return tuple(_file(each.stem, each.pair) for each in pairs)


def _file(stem: str, pair: MeasuredPair) -> ExportedFile:
    unsupported = (*no_anisotropy(pair, engine="Drake"), _kinetic(pair), *always_unsupported(pair))
    return ExportedFile(f"{stem}.drake.sdf", _world(stem, pair, unsupported), pair.name, unsupported)


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


def _world(stem: str, pair: MeasuredPair, unsupported: Sequence[str]) -> str:
    scene = scene_of(pair)
    about = [
        *measured_lines(pair),
        "Call plant.set_discrete_contact_approximation(DiscreteContactApproximation.kSap) before Finalize: with the "
        "default (lagged) the object starts about a degree early.",
        *unsupported_lines(unsupported),
    ]
    friction = _friction(each_material("harmonic", pair.mu))
    return sdf.world(
        stem,
        scene=scene,
        about=about,
        plate_surface=friction,
        object_collisions=_feet(scene, friction),
        namespace='xmlns:drake="http://drake.mit.edu"',
    )


def _feet(scene: Scene, friction: str) -> list[str]:
    radius = _FOOT * scene.side_m
    out = scene.side_m / 2 - radius
    return [
        sdf.collision(
            f"foot_{index}", place_m=(x * out, y * out, radius), geometry=sdf.sphere(radius), surface=friction
        )
        for index, (x, y) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1)))
    ]


def _friction(mu: float) -> str:
    return (
        f"<drake:proximity_properties><drake:mu_static>{number(mu)}</drake:mu_static>"
        f"<drake:mu_dynamic>{number(mu)}</drake:mu_dynamic></drake:proximity_properties>"
    )
