"""MuJoCo MJCF: a `<pair>` with both coefficients, the elliptic cone, and settings that hold a block.

A `<pair>` is read as it stands: MuJoCo combines nothing. The contact's settings are those of our own twin, whose
reasons and figures stand in station/simulators/mujoco/contact.py. For the frame of the ellipse see `mujoco_frame`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from station.export.exported import ExportedFile, NamedPair, measured_lines, number, unsupported_lines, xml_comment
from station.export.measured import MeasuredPair
from station.export.mujoco_frame import worst_turn_rad
from station.export.scene import scene_of, yaw_quaternion
from station.export.unsupported import always_unsupported, no_kinetic
from station.simulators.mujoco.contact import EXACT

NAME = "mujoco"
HELP = "MuJoCo MJCF: a <pair> with both coefficients, elliptic cone, a contact that holds"
_TIMESTEP_S = 0.001


def export(pairs: Sequence[NamedPair]) -> tuple[ExportedFile, ...]:
    """Returns a model for each pair."""
    return tuple(_file(each.stem, each.pair) for each in pairs)


def _file(stem: str, pair: MeasuredPair) -> ExportedFile:
    unsupported = (*_frame(pair), no_kinetic(pair, engine="MuJoCo"), *always_unsupported(pair))
    return ExportedFile(f"{stem}.mjcf.xml", _model(stem, pair, unsupported), pair.name, unsupported)


def _frame(pair: MeasuredPair) -> list[str]:
    """Tells where the ellipse stands and when it stays there."""
    if pair.isotropic:
        return []
    other = "plate" if pair.fixed_in == "object" else "object"
    turns = ", ".join(
        f"{math.degrees(worst_turn_rad(math.radians(tilt))):.1f} at {tilt} degrees" for tilt in (10, 20, 30)
    )
    moving = (
        "It holds while the object does not turn about z on a plate that stays level (turn gravity instead) or tilts "
        if pair.fixed_in == "object"
        else "It holds for a plate that stays level (turn gravity instead) or tilts "
    )
    return [
        "MuJoCo lays a contact's first tangent along the world's y axis, neither along the plate nor along the object: "
        f"the {pair.fixed_in} is therefore turned about z so that its axis of mu_1 points along the world's y. {moving}"
        "about the world's x or y axis. Tilted about another level axis the ellipse turns on the plate by up to "
        f"{turns}; where the contact's normal is 30 degrees or more towards the world's y, MuJoCo takes z in place of "
        f"y, and it may turn by up to 90. To hold it in a moving {pair.fixed_in}, set contact.frame in every step (see "
        "station/export/README.md). "
        f"The yaw of the {other} has no effect.",
    ]


def _model(stem: str, pair: MeasuredPair, unsupported: Sequence[str]) -> str:
    scene = scene_of(pair)
    yaw = 0.0 if pair.isotropic else math.pi / 2 - pair.axis_rad
    turned = f' quat="{_numbers(yaw_quaternion(yaw))}"'
    half, wide, thick = scene.side_m / 2, scene.plate_side_m / 2, scene.plate_thickness_m / 2
    about = [
        *measured_lines(pair),
        "To use it elsewhere take the <option> and the <pair> with your geoms' names; geom friction is not read then.",
        *unsupported_lines(unsupported),
    ]
    return f"""{xml_comment(about)}
<mujoco model="{stem}">
  <option timestep="{number(_TIMESTEP_S)}" cone="elliptic" impratio="{number(EXACT.impratio)}" \
tolerance="{number(EXACT.tolerance)}"/>
  <worldbody>
    <light pos="0 0 1"/>
    <body name="plate"{turned if pair.fixed_in == "plate" else ""}>
      <geom name="plate" type="box" size="{_numbers((wide, wide, thick))}" pos="{_numbers((0, 0, -thick))}" \
rgba="0.7 0.6 0.5 1"/>
    </body>
    <body name="object"{turned if pair.fixed_in == "object" else ""}>
      <freejoint/>
      <geom name="object" type="box" size="{_numbers((half,) * 3)}" pos="{_numbers((0, 0, half))}" \
mass="{number(scene.mass_kg)}" rgba="0.4 0.5 0.7 1"/>
    </body>
  </worldbody>
  <contact>
    <pair geom1="plate" geom2="object" condim="3" friction="{_numbers((pair.mu_1, pair.mu_2))} 0 0 0" \
solref="{_numbers(EXACT.solref)}" solreffriction="{_numbers(EXACT.solref_friction)}" solimp="{_numbers(EXACT.solimp)}"/>
  </contact>
</mujoco>
"""


def _numbers(values: Sequence[float]) -> str:
    return " ".join(number(value) for value in values)
