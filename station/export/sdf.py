"""The scene as an SDF world, around whatever a format says of friction.

Gazebo and Drake read the same elements for bodies and shapes; each has words of its own for a surface, and for what the
object stands on (a cube, or feet).
"""

from __future__ import annotations

from collections.abc import Sequence

from station.export.exported import number, xml_comment
from station.export.scene import Scene


def box(*sides_m: float) -> str:
    """Returns a box's geometry, by its three sides."""
    return f"<box><size>{' '.join(map(number, sides_m))}</size></box>"


def sphere(radius_m: float) -> str:
    """Returns a sphere's geometry."""
    return f"<sphere><radius>{number(radius_m)}</radius></sphere>"


def collision(name: str, *, place_m: Sequence[float], geometry: str, surface: str) -> str:
    """Returns a shape that touches, with its friction; `place_m` (3,) is its middle in the body's frame."""
    return f"""        <collision name="{name}">
          <pose>{_pose(place_m)}</pose>
          <geometry>{geometry}</geometry>
          {surface}
        </collision>"""


def world(
    name: str,
    *,
    scene: Scene,
    about: Sequence[str],
    plate_surface: str,
    object_collisions: Sequence[str],
    settings: str = "",
    namespace: str = "",
) -> str:
    """Returns the file: a static plate with its top at z = 0 and a cube on it.

    Args:
        name: the world's.
        scene: sizes and mass.
        about: lines of the comment at its head.
        plate_surface: the plate's friction, as an element of its collision.
        object_collisions: what the object touches with (`collision`), in the object's frame.
        settings: elements of the world itself, such as its time step.
        namespace: an attribute of the root, for elements of an engine's own.
    """
    plate = box(scene.plate_side_m, scene.plate_side_m, scene.plate_thickness_m)
    below, middle = (0.0, 0.0, -scene.plate_thickness_m / 2), (0.0, 0.0, scene.side_m / 2)
    touching = "\n".join(object_collisions)
    return f"""<?xml version="1.0"?>
{xml_comment(about)}
<sdf version="1.6"{namespace and " " + namespace}>
  <world name="{name}">{settings and chr(10) + settings}
    <model name="plate">
      <static>true</static>
      <link name="plate">
{collision("plate", place_m=below, geometry=plate, surface=plate_surface)}
{_visual("plate", place_m=below, geometry=plate)}
      </link>
    </model>
    <model name="object">
      <link name="object">
        <inertial>
          <pose>{_pose(middle)}</pose>
          <mass>{number(scene.mass_kg)}</mass>
{_inertia(scene)}
        </inertial>
{touching}
{_visual("object", place_m=middle, geometry=box(*[scene.side_m] * 3))}
      </link>
    </model>
  </world>
</sdf>
"""


def _pose(place_m: Sequence[float]) -> str:
    return " ".join(number(value) for value in (*place_m, 0.0, 0.0, 0.0))


def _visual(name: str, *, place_m: Sequence[float], geometry: str) -> str:
    return f"""        <visual name="{name}">
          <pose>{_pose(place_m)}</pose>
          <geometry>{geometry}</geometry>
        </visual>"""


def _inertia(scene: Scene) -> str:
    moment = number(scene.inertia_kg_m2)
    diagonal = "".join(f"<{axis}>{moment}</{axis}>" for axis in ("ixx", "iyy", "izz"))
    return f"          <inertia>{diagonal}<ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia>"
