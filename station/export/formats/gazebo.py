"""SDF for Gazebo (gz-sim with DART, Gazebo classic with ODE): mu, mu2 and fdir1, in one world.

Both engines take the smaller coefficient of the two surfaces, one axis at a time, and the direction of the surface that
has an fdir1. So the body in which the ellipse is fixed gets mu, mu2 and fdir1, and the other the larger of the two for
both. Without any fdir1 the axes would be the world's.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from station.export import sdf
from station.export.exported import ExportedFile, NamedPair, measured_lines, number, unsupported_lines
from station.export.measured import MeasuredPair
from station.export.scene import scene_of
from station.export.unsupported import always_unsupported, no_kinetic, pyramid_excess_rad

NAME = "gazebo"
_SETTINGS = """\
    <physics name="1ms" type="ode">
      <max_step_size>0.001</max_step_size>
      <ode><solver><type>quick</type><iters>200</iters><friction_model>cone_model</friction_model></solver></ode>
    </physics>"""
HELP = "SDF world for Gazebo: mu, mu2 and fdir1 (DART and ODE take the smaller of two)"


def export(pairs: Sequence[NamedPair]) -> tuple[ExportedFile, ...]:
    """Returns a world for each pair."""
    return tuple(_file(each.stem, each.pair) for each in pairs)


def _file(stem: str, pair: MeasuredPair) -> ExportedFile:
    unsupported = (_pyramid(pair), no_kinetic(pair, engine="Gazebo"), *always_unsupported(pair))
    return ExportedFile(f"{stem}.gazebo.sdf", _world(stem, pair, unsupported), pair.name, unsupported)


def _pyramid(pair: MeasuredPair) -> str:
    return (
        "DART (gz-sim) and ODE's pyramid limit the force along fdir1 and across it separately: right along the axes, "
        f"but between them the object starts up to {math.degrees(pyramid_excess_rad(pair)):.1f} degrees too late. "
        "Gazebo classic is asked for its cone_model, which parts the limit by the direction of the slide (not tried "
        "here); gz-sim ignores that setting."
    )


def _world(stem: str, pair: MeasuredPair, unsupported: Sequence[str]) -> str:
    scene = scene_of(pair)
    about = [
        *measured_lines(pair),
        "fdir1 is the direction of mu in the frame of its collision.",
        *unsupported_lines(unsupported),
    ]
    cube = sdf.collision(
        "object",
        place_m=(0.0, 0.0, scene.side_m / 2),
        geometry=sdf.box(*[scene.side_m] * 3),
        surface=_surface(pair, owner=pair.fixed_in == "object"),
    )
    return sdf.world(
        stem,
        scene=scene,
        about=about,
        plate_surface=_surface(pair, owner=pair.fixed_in == "plate"),
        object_collisions=[cube],
        settings=_SETTINGS,
    )


def _surface(pair: MeasuredPair, *, owner: bool) -> str:
    mu, mu2 = pair.mu_1, pair.mu_2 if owner else pair.mu_1
    axis = f"{number(math.cos(pair.axis_rad))} {number(math.sin(pair.axis_rad))} 0"
    direction = f"<fdir1>{axis}</fdir1>" if owner else ""
    return (
        f"<surface><friction><ode><mu>{number(mu)}</mu><mu2>{number(mu2)}</mu2>{direction}</ode></friction></surface>"
    )
