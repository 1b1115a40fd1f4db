"""The catalogue of effects: every file of the folder `effects`, and of the folders that a rig file names.

This is the only module of the physics that looks at files, and it only imports them.
"""

from __future__ import annotations

import copyreg
import importlib
import inspect
import pkgutil
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Any

from shared.config import Table, own_folders, parse
from shared.errors import UserError
from shared.own_module import module_in
from station.physics import effects
from station.physics.complete import fault_of
from station.physics.effect import Effect

Catalogue = Mapping[str, Effect]


def catalogue(folders: Iterable[Path] = ()) -> Catalogue:
    """Returns all effects by id: ours, then those of each folder in its order; an effect is one file with one subclass.

    Raises:
        UserError: if a folder is missing, a file cannot be imported or holds no complete effect, or an id comes twice.
    """
    found: dict[str, Effect] = {}
    for file, effect in [*_own(), *(each for folder in folders for each in _those_of(folder))]:
        if effect.id in found:
            raise UserError(f"Expected every effect once, but {effect.id} comes again from {file}; rename one of them")
        found[effect.id] = effect
    _refuse_unknown_names(found)
    return MappingProxyType(found)


@dataclass(frozen=True, kw_only=True)
class PhysicsSettings:
    """The table `[physics]` of a rig file: `effects` are folders in which every Python file is one effect."""

    effects: tuple[str, ...] = ()


def effect_folders(table: Table) -> tuple[Path, ...]:
    """Returns the folders that a `[physics]` table names, relative to its rig file.

    Raises:
        UserError: naming file, line and key of what is wrong; for folders that no file on disk names, such as those
            of a rig inside a recording: a stranger wrote it, and importing an effect runs it.
    """
    return own_folders(table, "effects", parse(PhysicsSettings, table).effects)


def catalogue_of_table(table: Table) -> Catalogue:
    """Returns our effects and those of the folders that a `[physics]` table names; raises as `catalogue` does."""
    return catalogue(effect_folders(table))


def confused(known: Catalogue, name: str) -> frozenset[str]:
    """Returns the effects that the standard protocol cannot tell from this one, whichever of the two says so."""
    others = {other.id for other in known.values() if name in other.confounded_with}
    return frozenset(others | set(known[name].confounded_with))


def _refuse_unknown_names(found: Catalogue) -> None:
    for effect in found.values():
        unknown = sorted(set(effect.confounded_with) - set(found))
        if unknown:
            raise UserError(f"Expected ids of effects in confounded_with of {effect.id}, got {', '.join(unknown)}")


def _own() -> list[tuple[str, Effect]]:
    names = sorted(info.name for info in pkgutil.iter_modules(effects.__path__))
    return [(name, _effect_of(importlib.import_module(f"{effects.__name__}.{name}"))) for name in names]


def _those_of(folder: Path) -> list[tuple[str, Effect]]:
    if not folder.is_dir():
        raise UserError(f"Expected a folder with effects at {folder} (physics.effects in the rig file), found none")
    files = [str(path.resolve()) for path in sorted(folder.glob("*.py")) if path.stem != "__init__"]
    return [(file, effect_in(file)) for file in files]


def _imported(path: Path) -> ModuleType:
    try:
        return module_in(path, name=f"repose_user_effects.{path.stem}")
    except Exception as error:
        raise UserError(
            f"Expected {path} to define an effect, but importing it failed: {' '.join(str(error).split())}"
        ) from error


def effect_in(file: str) -> Effect:
    """Returns the effect in a Python file, which another process can unpickle without knowing the folder.

    Raises:
        UserError: as `catalogue` does.
    """
    effect = _effect_of(_imported(Path(file)))

    def reduced(one: Any) -> tuple[Any, ...]:
        return effect_in, (file,), vars(one)

    copyreg.pickle(type(effect), reduced)
    return effect


def _effect_of(module: ModuleType) -> Effect:
    classes = [
        value
        for value in vars(module).values()
        if inspect.isclass(value) and issubclass(value, Effect) and value.__module__ == module.__name__
    ]
    if len(classes) != 1:
        raise UserError(f"Expected one subclass of Effect in {module.__file__}, found {len(classes)}")
    fault = fault_of(classes[0])
    if fault is not None:
        raise UserError(f"Expected in the effect {classes[0].__name__} of {module.__file__} {fault}")
    return classes[0]()
