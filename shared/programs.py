"""How to call the programs of this environment from a shell, for what is printed to be copied."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path


def how_to_call(name: str) -> str:
    """The program's name where it is on the path, else where this environment has it, from the present folder."""
    return name if shutil.which(name) else os.path.relpath(Path(sys.executable).parent / name)
