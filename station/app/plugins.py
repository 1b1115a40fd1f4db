"""Importers and simulators of the user's own: files in folders that the command line or the user's rig file names.

Such a folder has subfolders like ours: each Python file in `importers` is an importer, each Python file or MuJoCo scene
in `simulators` a simulator by its name. A rig file inside a recording is a stranger's: its folders are never read.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from shared.config import Table, own_folders, parse
from shared.errors import UserError
from station.simulators.simulator import names, suffixes


@dataclass(frozen=True, kw_only=True)
class PluginSettings:
    """The table `[plugins]` of a rig file: `folders` have subfolders `importers` and `simulators`."""

    folders: tuple[str, ...] = ()


def plugin_folders(table: Table | None, named: Iterable[Path] = ()) -> tuple[Path, ...]:
    """Returns the folders that the command line names, and those of the `[plugins]` table of the user's own rig file.

    Raises:
        UserError: for a folder that is missing, or has neither importers nor simulators; for folders that no file on
            disk names.
    """
    configured = () if table is None else own_folders(table, "folders", parse(PluginSettings, table).folders)
    found = (*named, *configured)
    for folder in found:
        if not any((folder / kind).is_dir() for kind in ("importers", "simulators")):
            raise UserError(
                f"Expected a folder with a subfolder 'importers' or 'simulators' at {folder}, "
                + ("found neither" if folder.is_dir() else "but there is no such folder")
            )
    return found


def importer_files(folders: Iterable[Path]) -> tuple[Path, ...]:
    """Returns the importers' files in the folders."""
    return tuple(path for folder in folders for path in sorted((folder / "importers").glob("[!_]*.py")))


def named_in(folders: Iterable[Path], name: str) -> str:
    """Returns the file of the user's own simulator that a name means, with the part after its colon.

    It is any other name as it is.

    Raises:
        UserError: if two files have one name, or one has that of a simulator of ours.
    """
    found: dict[str, Path] = {}
    for path in _simulators(folders):
        if path.stem in found or path.stem in names():
            other = found.get(path.stem, "one of ours")
            raise UserError(f"Expected another name for the simulator {path}, it is that of {other}; rename it")
        found[path.stem] = path
    stem, colon, part = name.partition(":")
    return f"{found[stem]}{colon}{part}" if stem in found else name


def _simulators(folders: Iterable[Path]) -> Iterator[Path]:
    for folder in folders:
        files = sorted((folder / "simulators").glob("[!_]*"))
        yield from (path for path in files if path.suffix in suffixes())
