"""The simulated rig's file with another surface pair in it."""

from __future__ import annotations

import tomllib

from shared.config import Table
from shared.errors import UserError
from shared.rig import RigConfig, rig_of_table
from station.app import assembly
from station.app.study.paper import PaperPair

DENSITIES_KG_M3 = {"steel": 7850.0, "wood": 500.0}
"""The blocks are of stainless steel and of pine."""


def rig_of(pair: PaperPair) -> RigConfig:
    """Returns the simulated rig with a pair's block, plate and friction.

    Its text says so, and the recording carries it.
    """
    path = assembly.simulated_rig_path()
    text = rig_text(path.read_text(encoding="utf-8"), pair)
    return rig_of_table(Table(tomllib.loads(text), str(path), text))


def rig_text(text: str, pair: PaperPair) -> str:
    """Returns a rig file with the lines that name block, plate and friction written anew.

    Raises:
        UserError: if the file lacks one of these lines.
    """
    rig = tomllib.loads(text)
    volume_m3 = float(rig["block"]["size_m"][0]) ** 3
    values = {
        ("plate", "material"): f'"{pair.plate}"',
        ("block", "name"): f'"{pair.object}"',
        ("block", "material"): f'"{pair.object}"',
        ("block", "mass_kg"): f"{DENSITIES_KG_M3[pair.object] * volume_m3:g}",
        ("twin", "pair"): f'"{pair.preset}"',
    }
    table, lines = "", list[str]()
    for line in text.splitlines():
        if line.startswith("["):
            table = line.strip("[] ")
        key = line.partition("=")[0].strip()
        value = values.pop((table, key), None)
        lines.append(line if value is None else f"{key} = {value}")
    if values:
        missing = ", ".join(f"{table}.{key}" for table, key in values)
        raise UserError(f"Expected the simulated rig's file to have {missing}, but it has not")
    return "\n".join(lines) + "\n"
