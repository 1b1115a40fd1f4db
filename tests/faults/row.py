"""One row of the table: a fault, what it needs, and what may be asked of the arm meanwhile."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from random import Random

from tests.faults import rows
from tests.faults.lab import Lab

Fault = Callable[[Lab, Random], None]


@dataclass(frozen=True)
class Row:
    """`fault` does it, waits as long as it lasts, and mends what nobody else would (starts what it has killed).

    `blind`: station or camera is not there while it lasts, so that nothing may move up; `network`: it needs links of
    our own; `ends`: the session is over afterwards, and a new one is started to see that the rig goes on; `ext4`: it
    wants the recordings on that file system.
    """

    name: str
    fault: Fault
    blind: bool = True
    network: bool = False
    ends: bool = False
    ext4: bool = False


def all_rows() -> tuple[Row, ...]:
    """Every row of every file in `rows`, by name."""
    names = sorted(module.name for module in pkgutil.iter_modules(rows.__path__))
    modules = [importlib.import_module(f"tests.faults.rows.{name}") for name in names]
    return tuple(row for module in modules for row in module.ROWS)
