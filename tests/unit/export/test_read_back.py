"""Each engine's own rule, applied to the exported file, gives the measured coefficients back."""

from __future__ import annotations

import importlib
import importlib.util
import math
import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from station.export.materials import combine
from station.export.measured import MeasuredPair
from station.simulators.mujoco.bindings import mj
from tests.unit.export.pairs import PAIRS, exported

every_pair = pytest.mark.parametrize(("stem", "pair"), PAIRS.items())


def exact(value: float) -> Any:
    return pytest.approx(value, rel=1e-9)


@every_pair
def test_mujoco(tmp_path: Path, stem: str, pair: MeasuredPair):
    model: Any = mj.MjModel.from_xml_path(str(exported(tmp_path, "mujoco") / f"{stem}.mjcf.xml"))
    assert model.opt.cone == mj.mjtCone.mjCONE_ELLIPTIC
    assert model.npair == 1
    assert model.pair_dim[0] == 3
    assert tuple(model.pair_friction[0, :2]) == exact_pair(pair)
    data = mj.MjData(model)
    mj.mj_forward(model, data)
    if not pair.isotropic:
        # The axis of mu_1, in the world, is y: there MuJoCo lays the first coefficient.
        frame = data.body(pair.fixed_in).xmat.reshape(3, 3)
        axis = frame @ [math.cos(pair.axis_rad), math.sin(pair.axis_rad), 0.0]
        assert axis == pytest.approx([0.0, 1.0, 0.0], abs=1e-9)
    assert model.body_mass[model.body("object").id] == exact(pair.mass_kg)


def exact_pair(pair: MeasuredPair) -> Any:
    return pytest.approx((pair.mu_1, pair.mu_2), rel=1e-9)


@every_pair
def test_gazebo_takes_the_smaller_axis_by_axis(tmp_path: Path, stem: str, pair: MeasuredPair):
    path = exported(tmp_path, "gazebo") / f"{stem}.gazebo.sdf"
    ode = {each.attrib["name"]: each.find(".//ode/mu/..") for each in ElementTree.parse(path).iter("model")}
    read = [combine("min", *(float(said(ode[body], name)) for body in ("plate", "object"))) for name in ("mu", "mu2")]
    assert tuple(read) == exact_pair(pair)
    other = "plate" if pair.fixed_in == "object" else "object"
    assert said(ode[pair.fixed_in], "fdir1").split() == pytest.approx(
        [f"{math.cos(pair.axis_rad):.10g}", f"{math.sin(pair.axis_rad):.10g}", "0"]
    )
    other_element = ode[other]
    assert other_element is not None
    assert other_element.find("fdir1") is None


def said(element: ElementTree.Element | None, name: str) -> str:
    assert element is not None
    return element.findtext(name, "")


@every_pair
def test_bullet_takes_the_product_scaled_along_the_axes(tmp_path: Path, stem: str, pair: MeasuredPair):
    folder = exported(tmp_path, "bullet")
    robots = {body: ElementTree.parse(folder / f"{stem}_{body}.urdf").getroot() for body in ("plate", "object")}
    factors = [float(robot.find(".//lateral_friction").attrib["value"]) for robot in robots.values()]  # pyright: ignore[reportOptionalMemberAccess] (an absent one fails the test)
    client = Listener()
    spec = importlib.util.spec_from_file_location("loader", folder / f"{stem}_bullet.py")
    assert spec
    assert spec.loader
    loader: Any = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loader)
    assert loader.load(client) == (f"{stem}_plate.urdf", f"{stem}_object.urdf")
    assert client.settings == {"enableConeFriction": 1}
    scale = client.anisotropic.get(f"{stem}_{pair.fixed_in}.urdf", [1, 1, 1])
    assert tuple(combine("product", *factors) * each for each in scale[:2]) == exact_pair(pair)
    assert len(client.anisotropic) == (0 if pair.isotropic else 1)
    for body, robot in robots.items():
        yaw = float(robot.find(".//inertial/origin").attrib["rpy"].split()[2])  # pyright: ignore[reportOptionalMemberAccess] (as above)
        assert yaw == exact(pair.axis_rad if body == pair.fixed_in and not pair.isotropic else 0.0)


class Listener:
    """A stand-in for pybullet that remembers what the loader says."""

    URDF_USE_INERTIA_FROM_FILE = 2

    def __init__(self) -> None:
        self.settings: dict[str, Any] = {}
        self.anisotropic: dict[str, list[float]] = {}

    def loadURDF(self, path: str, **_: Any) -> str:
        assert Path(path).exists()
        return Path(path).name

    def setPhysicsEngineParameter(self, **settings: Any) -> None:
        self.settings |= settings

    def changeDynamics(self, body: str, link: int, *, anisotropicFriction: list[float]) -> None:
        assert link == -1
        self.anisotropic[body] = anisotropicFriction


@every_pair
def test_drake_takes_the_harmonic_mean_of_mu_dynamic(tmp_path: Path, stem: str, pair: MeasuredPair):
    path = exported(tmp_path, "drake") / f"{stem}.drake.sdf"
    space = {"drake": "http://drake.mit.edu"}
    tree = ElementTree.parse(path)
    for name in ("mu_static", "mu_dynamic"):
        values = {
            model.attrib["name"]: {float(each.text or "") for each in model.iterfind(f".//drake:{name}", space)}
            for model in tree.iter("model")
        }
        ((plate,), (object_,)) = values["plate"], values["object"]
        assert combine("harmonic", plate, object_) == exact(pair.mu)
    assert len(tree.findall(".//sphere")) == 4


@every_pair
def test_usd_takes_the_average(tmp_path: Path, stem: str, pair: MeasuredPair):
    text = (exported(tmp_path, "usd") / f"{stem}.usda").read_text("utf-8")
    kinetic = pair.mu * (1.0 if math.isnan(pair.kinetic_ratio) else pair.kinetic_ratio)
    for name, wanted in (("static", pair.mu), ("dynamic", kinetic)):
        values = [float(value) for value in re.findall(rf"float physics:{name}Friction = (\S+)", text)]
        assert combine("average", *values) == exact(wanted)


@every_pair
def test_usd_reads_the_stage(tmp_path: Path, stem: str, pair: MeasuredPair):
    pytest.importorskip("pxr")
    usd, physics, shade = (importlib.import_module(f"pxr.{name}") for name in ("Usd", "UsdPhysics", "UsdShade"))
    stage: Any = usd.Stage.Open(str(exported(tmp_path, "usd") / f"{stem}.usda"))
    read: list[float] = []
    for name in ("Plate", "Object"):
        prim = stage.GetPrimAtPath(f"/World/{name}")
        assert prim.HasAPI(physics.CollisionAPI)
        material, _ = shade.MaterialBindingAPI(prim).ComputeBoundMaterial("physics")
        read.append(physics.MaterialAPI(material).GetStaticFrictionAttr().Get())
        assert material.GetPrim().GetAttribute("physxMaterial:frictionCombineMode").Get() == "average"
    assert combine("average", read[0], read[1]) == pytest.approx(pair.mu, rel=1e-6)
    body = stage.GetPrimAtPath("/World/Object")
    assert body.HasAPI(physics.RigidBodyAPI)
    assert physics.MassAPI(body).GetMassAttr().Get() == pytest.approx(pair.mass_kg, rel=1e-6)
