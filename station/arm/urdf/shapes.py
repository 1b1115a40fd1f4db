"""The points of a link's geometry: boxes, cylinders and spheres as such, meshes (STL, OBJ, DAE) by trimesh."""

from __future__ import annotations

import io
import logging
import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit
from xml.etree.ElementTree import Element

import numpy as np

from shared.errors import UserError
from shared.possible import LARGEST
from station.arm.urdf.chain import Body
from station.arm.urdf.reading import read_bounded, read_xml
from station.arm.urdf.robot import Shape, numbers, vector
from station.rig.arm_model import Array

_MOST_BYTES = 64_000_000
_MOST_PLACED_BYTES = 2_000_000_000
_SUFFIXES = (".stl", ".obj", ".dae")
_SECTIONS = 48
_ROUND = 1 / math.cos(math.pi / _SECTIONS)
"""A polygon's corners lie this much farther out than the circle that it goes round, so that it holds the circle."""


@dataclass(frozen=True, kw_only=True)
class Meshes:
    """The folders of a URDF's meshes: its own `folder`, and `packages`, those of package:// names."""

    folder: Path
    packages: Mapping[str, Path] = field(default_factory=dict[str, Path])

    def path(self, name: str) -> Path:
        """Returns the file that a <mesh filename=...> names.

        Raises:
            UserError: for an unknown package, or an address in the network.
        """
        parts = urlsplit(name)
        if parts.scheme == "package":
            if parts.netloc not in self.packages:
                raise UserError(f"The URDF names {name}: say where that package is, --package {parts.netloc}=FOLDER")
            return self.packages[parts.netloc] / unquote(parts.path.lstrip("/"))
        if parts.scheme in ("", "file"):
            return self.folder / unquote(parts.path)
        raise UserError(f"Expected the mesh {name} in a file beside the URDF (or package://), not at a {parts.scheme}:")


def points_of(body: Body, meshes: Meshes) -> Array:
    """Gives points (n, 3) that span the geometry of a body, or a little more, in its frame (m); none where it has none.

    Raises:
        UserError: if a mesh is missing or cannot be read, or a shape's sizes are wrong.
    """
    clouds = [
        _placed(_points(shape, meshes, where=f"link {link.name!r}"), body_from_link @ shape.link_from_shape)
        for link, body_from_link in body.links
        for shape in link.shapes
    ]
    return np.concatenate([np.empty((0, 3)), *clouds])


def _placed(points: Array, a_from_b: Array) -> Array:
    return points @ a_from_b[:3, :3].T + a_from_b[:3, 3]


def _points(shape: Shape, meshes: Meshes, *, where: str) -> Array:
    element = shape.element
    if element.tag == "box":
        corners = np.array(np.meshgrid(*[(-0.5, 0.5)] * 3)).reshape(3, -1).T
        return corners * _sizes(element, "size", 3, where)
    if element.tag == "cylinder":
        (radius,), (length,) = _sizes(element, "radius", 1, where), _sizes(element, "length", 1, where)
        return np.concatenate([_ring(radius, -length / 2), _ring(radius, length / 2)])
    if element.tag == "sphere":
        (radius,) = _sizes(element, "radius", 1, where)
        heights = np.cos(np.linspace(0, np.pi, _SECTIONS // 2 + 1)).tolist()
        rings = [_ring(math.sqrt(max(0.0, 1 - z * z)), z) for z in heights]
        return radius * _ROUND * np.concatenate(rings)
    if element.tag == "mesh":
        scale = np.array(vector(element, "scale", where=where, default=(1.0, 1.0, 1.0)))
        return _mesh(meshes.path(element.get("filename", ""))) * scale
    raise UserError(f"Expected a box, cylinder, sphere or mesh in the {where} of the URDF, got <{element.tag}>")


def _sizes(element: Element, key: str, count: int, where: str) -> Array:
    found = np.array(numbers(element, key, count=count, where=where))
    if not (found > 0).all():
        raise UserError(f"Expected a positive {key} in the {where} of the URDF, got {element.get(key)!r}")
    return found


def _ring(radius: float, height: float) -> Array:
    """Returns the corners (n, 3) of a polygon round a circle."""
    turns, out = np.arange(_SECTIONS) * (2 * np.pi / _SECTIONS), radius * _ROUND
    return np.stack([out * np.cos(turns), out * np.sin(turns), np.full(_SECTIONS, height)], axis=1)


def _mesh(path: Path) -> Array:
    """Returns the corners (n, 3) of a mesh in metres; only this one file is read, whatever it refers to."""
    import trimesh  # noqa: PLC0415 - only an import of an arm needs it

    suffix = path.suffix.lower()
    if suffix not in _SUFFIXES:
        raise UserError(f"Expected a mesh as {', '.join(_SUFFIXES)}, got {path}: convert it")
    data = read_bounded(path, most_bytes=_MOST_BYTES, what="a mesh")
    metres = _collada_unit(data, path) if suffix == ".dae" else 1.0
    logging.getLogger("trimesh").setLevel(logging.CRITICAL)  # textures are missing, and are not wanted
    try:
        scene: Any = trimesh.load_scene(io.BytesIO(data), file_type=suffix[1:])
        clouds = [_instance(scene, node) for node in scene.graph.nodes_geometry]
    except Exception as error:  # a reader of broken files raises anything
        raise UserError(f"Expected a mesh at {path}, but it cannot be read: {type(error).__name__}: {error}") from error
    points = np.concatenate([np.empty((0, 3)), *clouds]) * metres
    if not len(points) or not (np.abs(points) <= LARGEST).all():
        raise UserError(f"Expected a mesh of finite points within {LARGEST:g} m at {path}, found none, or others")
    return points


def _instance(scene: Any, node: str) -> Array:
    world_from_node, name = scene.graph[node]
    return _placed(np.unique(np.asarray(scene.geometry[name].vertices, dtype=np.float64), axis=0), world_from_node)


def _collada_unit(data: bytes, path: Path) -> float:
    """Returns the metres of a COLLADA file's unit; its up axis is not looked at, as in RViz.

    Raises:
        UserError: if its parts place each other so often that it grows without bounds, as an entity bomb does.
    """
    import_module("collada")  # where trimesh's reader of it is missing, that is no fault of the file
    root = read_xml(data, what=str(path))
    urls = {
        tag: Counter(found.get("url", "")[1:] for found in root.iter(f"instance_{tag}")) for tag in ("node", "geometry")
    }
    nested = any(
        node.get("id") in urls["node"] and node.find(".//instance_node") is not None for node in root.iter("node")
    )
    most = max(urls["geometry"].values(), default=0) * (1 + urls["node"].total())
    if nested or most * len(data) > _MOST_PLACED_BYTES:
        raise UserError(f"Expected a mesh whose parts do not place each other over and over at {path}: join them")
    unit = root.find("asset/unit")
    return 1.0 if unit is None or unit.get("meter") is None else numbers(unit, "meter", count=1, where=str(path))[0]
