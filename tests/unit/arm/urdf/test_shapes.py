"""The points of geometry, and the capsule round them; a mesh's file is read, and no other."""

from __future__ import annotations

import struct
from pathlib import Path
from xml.etree.ElementTree import fromstring

import numpy as np
import pytest

from shared.errors import UserError
from station.arm.urdf.capsule import enclosing_capsule
from station.arm.urdf.chain import Body
from station.arm.urdf.robot import Link, Shape
from station.arm.urdf.shapes import Meshes, points_of
from station.rig.arm_model import Array

pytest.importorskip("trimesh", reason="the extra urdf is not installed")

CORNERS = np.array([[x, y, z] for x in (0.0, 0.3) for y in (0.0, 0.1) for z in (0.0, 0.2)])
FACES = [(0, 1, 2), (3, 2, 1), (4, 5, 6), (7, 6, 5), (0, 4, 1), (5, 1, 4), (2, 3, 6), (7, 6, 3)]
DAE = """<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><created>2020-01-01T00:00:00</created><modified>2020-01-01T00:00:00</modified><unit meter="0.001"/></asset>
<library_geometries><geometry id="g"><mesh>
<source id="s"><float_array id="a" count="24">{points}</float_array>
<technique_common><accessor source="#a" count="8" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
</accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#s"/></vertices>
<triangles count="8"><input semantic="VERTEX" source="#v" offset="0"/><p>{faces}</p></triangles>
</mesh></geometry></library_geometries>{nodes}
<library_visual_scenes><visual_scene id="w"><node id="n"><translate>0 0 500</translate>{inside}</node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#w"/></scene></COLLADA>"""
PLACED = '<instance_geometry url="#g"/>'


def dae(*, nodes: str = "", inside: str = PLACED) -> bytes:
    points, faces = (" ".join(map(str, np.ravel(values))) for values in (1000 * CORNERS, FACES))
    return DAE.format(points=points, faces=faces, nodes=nodes, inside=inside).encode()


def stl() -> bytes:
    packed = (struct.pack("<12fH", 0, 0, 0, *CORNERS[list(face)].ravel(), 0) for face in FACES)
    return bytes(80) + struct.pack("<I", len(FACES)) + b"".join(packed)


def obj() -> bytes:
    lines = [f"v {x} {y} {z}" for x, y, z in CORNERS] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in FACES]
    return "\n".join(["mtllib ../secret.mtl", "usemtl other", *lines]).encode()


def points(geometry: str, folder: Path, **packages: Path) -> Array:
    shape = Shape(element=fromstring(geometry), link_from_shape=np.eye(4))
    body = Body(links=((Link(name="arm", mass_kg=None, shapes=(shape,)), np.eye(4)),))
    return points_of(body, Meshes(folder=folder, packages=packages))


@pytest.mark.parametrize(
    ("geometry", "low", "high"),
    [
        ('<box size="0.2 0.4 0.6"/>', (-0.1, -0.2, -0.3), (0.1, 0.2, 0.3)),
        ('<cylinder radius="0.1" length="0.6"/>', (-0.1, -0.1, -0.3), (0.1, 0.1, 0.3)),
        ('<sphere radius="0.1"/>', (-0.1, -0.1, -0.1), (0.1, 0.1, 0.1)),
    ],
)
def test_simple_shapes_fill_their_sizes(
    geometry: str, low: tuple[float, ...], high: tuple[float, ...], tmp_path: Path
) -> None:
    found = points(geometry, tmp_path)
    np.testing.assert_allclose([found.min(axis=0), found.max(axis=0)], [low, high], rtol=0.005)
    assert (found.min(axis=0) <= np.add(low, 1e-12)).all(), "the shape is held"
    assert (found.max(axis=0) >= np.subtract(high, 1e-12)).all(), "the shape is held"


@pytest.mark.parametrize(
    ("name", "data", "lifted"), [("a.stl", stl(), 0.0), ("b.OBJ", obj(), 0.0), ("c.dae", dae(), 0.5)]
)
def test_meshes_are_read_in_metres_wherever_they_are_named(
    name: str, data: bytes, lifted: float, tmp_path: Path
) -> None:
    (tmp_path / name).write_bytes(data)
    wanted = np.add([CORNERS.min(axis=0), CORNERS.max(axis=0)], [0, 0, lifted])
    for file in (name, f"package://mine/{name}", f"file://{tmp_path / name}"):
        found = points(f'<mesh filename="{file}" scale="1 1 2"/>', tmp_path, mine=tmp_path)
        np.testing.assert_allclose([found.min(axis=0), found.max(axis=0)], wanted * [1, 1, 2], atol=1e-6)


def test_only_the_mesh_s_own_file_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "arm").mkdir()
    (tmp_path / "arm" / "b.obj").write_bytes(obj())
    (tmp_path / "secret.mtl").write_text("newmtl other")
    opened: list[str] = []
    really = Path.open

    def noted(path: Path, mode: str) -> object:
        opened.append(path.name)
        return really(path, mode)

    def refused(path: object, *_: object) -> None:
        pytest.fail(f"{path} was opened")

    monkeypatch.setattr(Path, "open", noted)
    monkeypatch.setattr("builtins.open", refused)
    points('<mesh filename="b.obj"/>', tmp_path / "arm")
    assert opened == ["b.obj"]


NESTED = '<library_nodes><node id="a">' + '<instance_node url="#b"/>' * 9 + '</node><node id="b"/></library_nodes>'


@pytest.mark.parametrize(
    ("geometry", "data", "named"),
    [
        ('<mesh filename="none.stl"/>', b"", "there is no such file"),
        ('<mesh filename="a.step"/>', b"", "convert it"),
        ('<mesh filename="http://here/a.stl"/>', b"", "not at a http:"),
        ('<mesh filename="package://mine/a.stl"/>', b"", "--package mine=FOLDER"),
        ('<mesh filename="a.stl"/>', b"solid nothing", "a mesh of finite points|cannot be read"),
        ('<mesh filename="a.stl"/>', stl()[:-9], "cannot be read|finite points"),
        ('<mesh filename="a.obj"/>', b"v 1 2\nf 1 2 3", "cannot be read|finite points"),
        ('<mesh filename="a.dae"/>', b"<a/>", "cannot be read|finite points"),
        ('<mesh filename="a.dae"/>', b"<!DOCTYPE a>" + dae(), "no <!DOCTYPE>"),
        ('<mesh filename="a.dae"/>', dae(nodes=NESTED, inside='<instance_node url="#a"/>'), "over and over"),
        ('<sphere radius="-1"/>', b"", "positive radius"),
        ('<box size="1 1"/>', b"", "3 finite numbers as size of the link 'arm'"),
        ('<box size="1e308 1 1"/>', b"", "none beyond 1e.09, got '1e308 1 1'"),
        ('<sphere radius="1e200"/>', b"", "got '1e200'"),
        ("<capsule/>", b"", "got <capsule>"),
    ],
)
def test_what_cannot_be_read_is_named(geometry: str, data: bytes, named: str, tmp_path: Path) -> None:
    if data:
        (tmp_path / fromstring(geometry).get("filename", "")).write_bytes(data)
    with pytest.raises(UserError, match=named) as refused:
        points(geometry, tmp_path)
    assert "\n" not in str(refused.value)


def test_a_capsule_is_found_again_however_it_lies() -> None:
    rng = np.random.default_rng(4)
    first, last = rng.uniform(-0.2, 0.2, (2, 3))
    around: Array = rng.normal(size=(3000, 3))
    around *= 0.05 / np.linalg.norm(around, axis=1, keepdims=True)
    cloud: Array = first + rng.uniform(0, 1, (3000, 1)) * (last - first) + around
    cloud = np.concatenate([cloud, first + around, last + around])
    found = enclosing_capsule(cloud.astype(np.float64))
    ends = np.array(sorted([found.from_m, found.to_m]))
    np.testing.assert_allclose(ends, sorted([first.tolist(), last.tolist()]), atol=2e-3)
    assert found.radius_m == pytest.approx(0.05, abs=1e-3)


@pytest.mark.parametrize("sizes", [(0.4, 0.1, 0.1), (0.1, 0.1, 0.1), (0.3, 0.3, 0.0), (0.0, 0.0, 0.0)])
def test_a_capsule_holds_every_point_and_has_a_length(sizes: tuple[float, ...]) -> None:
    cloud: Array = np.add((CORNERS > 0) * np.array(sizes, np.float64), [0.1, 0.2, 0.3]).astype(np.float64)
    found = enclosing_capsule(cloud)
    first, last = np.array(found.from_m), np.array(found.to_m)
    share = np.clip((cloud - first) @ (last - first) / ((last - first) @ (last - first)), 0, 1)
    away = np.linalg.norm(cloud - first - share[:, None] * (last - first), axis=1)
    assert away.max() <= found.radius_m
    assert found.radius_m <= np.linalg.norm(sizes) / 2 + 2e-3
    assert np.linalg.norm(last - first) > 5e-4
