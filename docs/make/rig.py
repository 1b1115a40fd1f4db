"""The reference of rig files: the tables that both sides read, and those of each plug-in."""

from __future__ import annotations

import ast
import importlib
import inspect
import tomllib
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

from docs.make.fields import heading
from docs.make.keys import Explained, explained_in, tables
from shared.config import Table
from shared.rig import RigConfig
from station.angles.settings import SourceSettings
from station.app.plugins import PluginSettings
from station.physics.catalogue import PhysicsSettings
from station.rig.arm_settings import ArmSettings
from station.simulators.mujoco.own_settings import MujocoSettings
from station.simulators.mujoco.settings import TwinSettings

ROOT = Path(__file__).parents[2]
_OF_THE_STATION: dict[str, type[Any]] = {
    "arm": ArmSettings,
    "angles.NAME": SourceSettings,
    "physics": PhysicsSettings,
    "plugins": PluginSettings,
    "simulator.mujoco": MujocoSettings,
    "twin": TwinSettings,
}
"""The tables that a rig file hands on unread, and what reads them."""
_PLUGINS = {
    "camera.options": "pi_agent/cameras",
    "arm.options": "station/arm/drivers",
    "angles.NAME": "station/angles/sources",
}
_NOT_KEYS = frozenset({"text"})


def page() -> str:
    """The whole page."""
    text = (ROOT / "deploy" / "rig.example.toml").read_text("utf-8")
    explained, shown = explained_in(text), _plugins_shown_in(tomllib.loads(text))
    explained = {key.replace("angles.kinematics.", "angles.NAME."): said for key, said in explained.items()}
    parts = [
        heading(1, "Rig files"),
        "Every key of rig.toml, written from the classes that read it; what each means is from "
        "`deploy/rig.example.toml`. A key that is left out has its default; one that does not exist is refused, "
        "with its line.",
        heading(2, "Tables"),
        *tables("", RigConfig, explained=explained, leave_out=_NOT_KEYS),
        *(part for name, cls in _OF_THE_STATION.items() for part in tables(name, cls, explained=explained)),
        heading(2, "Options of each plug-in"),
        *(part for name, folder in _PLUGINS.items() for part in _options(name, folder, explained, shown)),
    ]
    return "\n\n".join(parts) + "\n"


def _plugins_shown_in(example: dict[str, Any]) -> frozenset[str]:
    """The plug-ins whose options the example explains."""
    return frozenset({example["camera"]["driver"], example["arm"]["driver"], *example["angles"]})


def _options(name: str, folder: str, explained: Explained, shown: frozenset[str]) -> Iterator[str]:
    for path in sorted((ROOT / folder).glob("[a-z]*.py")):
        module = importlib.import_module(f"{folder.replace('/', '.')}.{path.stem}")
        for cls in _read_by(module):
            first, *rest = tables(name, cls, explained=explained if path.stem in shown else {})
            yield first.replace(f"[{name}]", f"[{name}] of {path.stem}", 1)
            yield from rest


def _read_by(module: ModuleType) -> list[type[Any]]:
    """The classes that a module reads tables into: `parse(CLASS, ...)`."""
    calls = (node for node in ast.walk(ast.parse(inspect.getsource(module))) if isinstance(node, ast.Call))
    named = [call.args[0].id for call in calls if _is_parse(call) and isinstance(call.args[0], ast.Name)]
    found = [getattr(module, name) for name in dict.fromkeys(named)]
    return [cls for cls in found if cls is not Table]


def _is_parse(call: ast.Call) -> bool:
    return isinstance(call.func, ast.Name) and call.func.id == "parse" and bool(call.args)
