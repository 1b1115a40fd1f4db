"""Reads the names of a scene's bodies: the small TOML file beside it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from shared.config import load_table, parse


@dataclass(frozen=True, kw_only=True)
class Keys:
    """The names in a scene: `block` is a body with a free joint, `plate` a body, or a geom, that is fixed to the world.

    The plate's frame has its origin in the plate's middle, and z along its normal.
    """

    block: str = "block"
    plate: str = "plate"


def keys_beside(scene: Path) -> Keys:
    """Gives the keys in the TOML file that has the scene's name (scene.xml: scene.toml); without one, those of `Keys`.

    Raises:
        UserError: naming file, line and key of what is wrong.
    """
    beside = scene.with_suffix(".toml")
    return parse(Keys, load_table(beside)) if beside.is_file() else Keys()
