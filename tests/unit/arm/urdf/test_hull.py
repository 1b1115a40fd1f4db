"""The hull of a link holds its geometry, stands out little, and is what collisions are looked for with."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from xml.etree.ElementTree import fromstring

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from station.arm.collision import CollisionScene
from station.arm.planning import assess
from station.arm.tilt_path import tilt_stage
from station.arm.urdf.chain import Body, chain_of
from station.arm.urdf.hull import enclosing_hull
from station.arm.urdf.robot import Link, Shape, read_robot
from station.arm.urdf.shapes import Meshes, points_of
from station.rig.arm_model import ArmModel, Array, Capsule, load_arm_model
from station.rig.arm_settings import ObstacleSettings

Rng = np.random.Generator


def out_m(points: Array, corners: object) -> float:
    """Returns how far the farthest point stands out of the body that the corners span; not above 0 if none does."""
    faces = ConvexHull(np.array(corners)).equations
    return float((points @ faces[:, :3].T + faces[:, 3]).max())


def on_cylinder(rng: Rng) -> Array:
    turns = rng.uniform(0, math.tau, 5000)
    return np.stack([0.06 * np.cos(turns), 0.06 * np.sin(turns), rng.choice([-0.2, 0.2], 5000)], axis=1)


def on_sphere(rng: Rng) -> Array:
    points: Array = rng.normal(size=(5000, 3))
    return 0.06 * points / np.linalg.norm(points, axis=1, keepdims=True)


def on_box(rng: Rng) -> Array:
    return np.array([[x, y, z] for x in (-0.1, 0.1) for y in (-0.05, 0.05) for z in (-0.03, 0.03)])


@pytest.mark.parametrize(
    ("geometry", "surface", "most_m"),
    [
        ('<cylinder radius="0.06" length="0.4"/>', on_cylinder, 0.003),
        ('<sphere radius="0.06"/>', on_sphere, 0.010),
        ('<box size="0.2 0.1 0.06"/>', on_box, 0.0003),
    ],
)
def test_a_round_shape_is_in_its_hull_and_fills_it(
    geometry: str, surface: Callable[[Rng], Array], most_m: float, tmp_path: Path
) -> None:
    """A sphere's faces are all alike, and the last bits choose among them: 7.2 and 8.3 mm on two processors' paths."""
    shape = Shape(element=fromstring(geometry), link_from_shape=np.eye(4))
    body = Body(links=((Link(name="arm", mass_kg=None, shapes=(shape,)), np.eye(4)),))
    corners = enclosing_hull(points_of(body, Meshes(folder=tmp_path)))
    real = surface(np.random.default_rng(3))
    assert out_m(real, corners) <= 0.0
    assert 0.0 < out_m(np.array(corners), real) < most_m


@pytest.mark.parametrize("seed", range(5))
def test_whatever_the_cloud_none_of_it_is_cut_off(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points: Array = rng.normal(size=(rng.integers(4, 400), 3)) * rng.uniform(0.005, 0.3, 3) + rng.normal(size=3)
    corners = enclosing_hull(points)
    assert out_m(points, corners) <= 0.0
    assert len(corners) < 100


@pytest.mark.parametrize("sizes", [(0.3, 0.3, 0.0), (0.3, 0.0, 0.0), (0.0, 0.0, 0.0)])
def test_what_is_flat_has_no_hull(sizes: tuple[float, ...]) -> None:
    assert enclosing_hull(np.random.default_rng(1).uniform(0, 1, (20, 3)) * sizes) == ()


def reaches_deg(model: ArmModel) -> Array:
    stage = tilt_stage(model, base_xyz_m=(0, 0, 0), base_yaw_rad=model.home_yaw_rad, home_rad=model.home_rad)
    scene = CollisionScene(model, world_from_base=stage.world_from_base, obstacles=ObstacleSettings())
    azimuths = np.radians(np.arange(0, 360, 45)).tolist()
    return np.degrees([reach.angle_rad for reach in assess(stage, scene=scene, azimuths_rad=azimuths).reaches])


def test_the_ur5e_tilts_60_degrees_whichever_way() -> None:
    model = load_arm_model("ur5e")
    joints = tuple(replace(joint, link_hull_m=()) for joint in model.joints)
    with_hulls, with_capsules = reaches_deg(model), reaches_deg(replace(model, joints=joints))
    assert with_hulls.min() >= 60.0
    assert (with_hulls >= with_capsules).all()


def test_distances_are_taken_from_the_hull_and_the_mass_is_the_link_s() -> None:
    """The hull of a link's capsule is as far from everything as the capsule, less what it stands out of it."""
    model = load_arm_model("jaco2_spherical")
    hulls = tuple(replace(joint, link_hull_m=enclosing_hull(surface(joint.link_capsule))) for joint in model.joints)
    scenes = [
        CollisionScene(one, world_from_base=np.eye(4), obstacles=ObstacleSettings())
        for one in (model, replace(model, joints=hulls))
    ]
    near = 0
    for q in np.random.default_rng(2).uniform(-math.pi, math.pi, (60, 6)):
        capsule, hull = (scene.clearance(q) for scene in scenes)
        torques = [scene.holding_torque_nm(q) for scene in scenes]
        np.testing.assert_allclose(torques[0], torques[1], atol=1e-9)
        if capsule.distance_m > 0.01:
            near += capsule.distance_m < 0.2
            assert capsule.distance_m - 0.014 < hull.distance_m <= capsule.distance_m + 1e-4
    assert near > 5


def surface(capsule: Capsule) -> Array:
    points: Array = np.random.default_rng(5).normal(size=(4000, 3))
    points *= capsule.radius_m / np.linalg.norm(points, axis=1, keepdims=True)
    return np.concatenate([points + capsule.from_m, points + capsule.to_m])


@pytest.mark.skipif(
    find_spec("airo_models") is None, reason="airo-models is not installed (the dependency group tools)"
)
def test_the_ur5e_s_hulls_hold_its_meshes() -> None:
    pytest.importorskip("trimesh", reason="the extra urdf is not installed")
    spec = find_spec("airo_models")
    assert spec is not None
    assert spec.origin is not None
    urdf = Path(spec.origin).parent / "arms/ur5e/ur5e.urdf"
    chain = chain_of(read_robot(urdf), base="base_link", tip="tool0")
    for joint, (_, _, body) in zip(load_arm_model("ur5e").joints, chain.steps, strict=True):
        points = points_of(body, Meshes(folder=urdf.parent))
        assert out_m(points, joint.link_hull_m) <= 0.0
        assert out_m(np.array(joint.link_hull_m), points) < 0.008
