"""A Python file: one of its functions is called for each run."""

from __future__ import annotations

from pathlib import Path

from station.simulators.simulator import Simulator
from station.simulators.yours.called import of_file


def opened(path: Path, part: str, *, limit_s: float) -> Simulator:
    """Returns the simulator of a file; `part` names the function (empty: `simulate`), `limit_s` is the longest run's.

    Raises:
        UserError: if it cannot be loaded.
    """
    return of_file(path, part, limit_s=limit_s)
