"""The block in plain NumPy: each step asks the law of the model, and moves the block by what it says."""

from __future__ import annotations

from station.export.carried.block import Block
from station.export.carried.law import Law
from station.export.carried.watch import Watch
from station.export.exported import ExportedFile
from station.export.from_model import NamedModel
from station.export.python_file import SAID, python_file
from station.physics.model import Model

NAME = "numpy"
HELP = "the model in plain NumPy, with a block that is stepped by it (Python)"


def export_model(named: NamedModel) -> tuple[ExportedFile, ...]:
    """Returns one file."""
    how = [
        f"Friction of a block as {named.stem} says it, in plain NumPy.",
        "block = Block(Law(MODEL, Watch())) lies on the plate; block.advance(gravity) takes one step under gravity "
        "(3,), m/s², in the plate's frame, and gives x, y and yaw.",
    ]
    return (python_file(named, engine="numpy", supported=SAID, how=how, bench=bench),)


def bench(model: Model) -> Block:
    """Returns a block at rest in the middle of the plate."""
    return Block(Law(model, Watch()))
