"""The URDF of one of our own models, so that what an import gives back is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from station.rig.arm_model import ArmModel, Capsule

STAGE = """<robot name="stage">
  <link name="foot"><collision><geometry><box size="0.2 0.1 0.02"/></geometry></collision></link>
  <joint name="tilts" type="revolute">
    <parent link="foot"/><child link="ring"/><origin xyz="0 0 0.1"/><axis xyz="0 0 2"/>
    <limit lower="-1.0" upper="1.2" velocity="0.5" effort="3"/>
  </joint>
  <link name="ring"/>
  <joint name="mount" type="fixed"><parent link="ring"/><child link="plate"/><origin xyz="0 0 0.01"/></joint>
  <link name="plate"/>
</robot>
"""
"""One axis, upright, with little said of it."""


def numbers(values: object) -> str:
    return " ".join(map(repr, np.asarray(values, dtype=float).ravel().tolist()))


def collision(capsule: Capsule) -> str:
    """A cylinder with a ball at each end, which is a capsule."""
    first, last = np.array(capsule.from_m), np.array(capsule.to_m)
    turn = Rotation.align_vectors([last - first], [[0, 0, 1]])[0].as_euler("xyz")
    radius, long = capsule.radius_m, float(np.linalg.norm(last - first))
    parts = [((first + last) / 2, turn, f'<cylinder radius="{radius}" length="{long!r}"/>')]
    parts += [(end, np.zeros(3), f'<sphere radius="{radius}"/>') for end in (first, last)]
    return "".join(
        f'<collision><origin xyz="{numbers(xyz)}" rpy="{numbers(rpy)}"/><geometry>{shape}</geometry></collision>'
        for xyz, rpy, shape in parts
    )


def link(name: str, mass_kg: float, capsule: Capsule) -> str:
    return f'<link name="{name}"><inertial><mass value="{mass_kg}"/></inertial>{collision(capsule)}</link>'


def urdf_of(model: ArmModel) -> str:
    """The arm from `foot` to `flange`; between joints there is a fixed one, as URDFs have them."""
    text = [link("foot", model.base_mass_kg, model.base_capsule)]
    parent = "foot"
    for joint in model.joints:
        kind = "continuous" if joint.lower_rad is None else "revolute"
        ends = "" if joint.lower_rad is None else f'lower="{joint.lower_rad!r}" upper="{joint.upper_rad!r}"'
        text += [
            link(f"{joint.name}_link", joint.link_mass_kg, joint.link_capsule),
            f'<link name="{joint.name}_mount"/>',
            f'<joint name="{joint.name}_fixed" type="fixed"><parent link="{parent}"/>'
            f'<child link="{joint.name}_mount"/><origin xyz="{numbers(joint.origin_xyz_m)}"/></joint>',
            f'<joint name="{joint.name}" type="{kind}"><parent link="{joint.name}_mount"/>'
            f'<child link="{joint.name}_link"/><origin rpy="{numbers(joint.origin_rpy_rad)}"/>'
            f'<axis xyz="{numbers(joint.axis)}"/>'
            f'<limit {ends} velocity="{joint.max_velocity_rad_s!r}" effort="{joint.max_effort_nm!r}"/></joint>',
        ]
        parent = f"{joint.name}_link"
    text += [
        '<link name="flange"/>',
        f'<joint name="end" type="fixed"><parent link="{parent}"/><child link="flange"/>'
        f'<origin xyz="{numbers(model.flange_xyz_m)}" rpy="{numbers(model.flange_rpy_rad)}"/></joint>',
    ]
    return f'<robot name="{model.name}">{"".join(text)}</robot>'


def written(folder: Path, text: str) -> Path:
    path = folder / "robot.urdf"
    path.write_text(text, encoding="utf-8")
    return path
