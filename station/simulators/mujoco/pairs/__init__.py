"""Friction of known material pairs, one TOML file each; `load_pair` reads them by name."""

from __future__ import annotations

from pathlib import Path

from shared.config import load_table, parse
from shared.errors import UserError
from station.simulators.mujoco.specimen import Friction

PAIRS = Path(__file__).parent


def pair_names() -> tuple[str, ...]:
    """Returns the names of the pairs that come with the package."""
    return tuple(sorted(entry.stem for entry in PAIRS.glob("*.toml")))


def load_pair(name_or_path: str | Path) -> Friction:
    """Reads a pair's friction: a name of `pair_names`, or the path of a TOML file with the fields of `Friction`.

    Raises:
        UserError: if there is no such pair, or its file is wrong (the line is named).
    """
    path = Path(name_or_path)
    if path.suffix != ".toml":
        path = PAIRS / f"{name_or_path}.toml"
        if not path.is_file():
            raise UserError(
                f"Expected a pair of materials ('pair' in [twin]) to be one of {', '.join(pair_names())}, "
                f"or the path of a pair's TOML file, got '{name_or_path}'"
            )
    return parse(Friction, load_table(path))
