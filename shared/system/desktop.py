"""The desktop: whether a window can be opened, what a program's file is called, and how a path is typed."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from pathlib import Path

PROGRAM_SUFFIX = ".exe" if sys.platform == "win32" else ""
"""The ending of a program file's name."""

if sys.platform in ("win32", "darwin"):

    def has_display(environment: Mapping[str, str] = os.environ) -> bool:
        """Returns true if a window can be opened here: everywhere but in a session from another machine."""
        return "SSH_CONNECTION" not in environment

else:

    def has_display(environment: Mapping[str, str] = os.environ) -> bool:
        """Returns true if a window can be opened here."""
        return bool(environment.get("DISPLAY") or environment.get("WAYLAND_DISPLAY"))


def from_here(path: Path) -> str:
    """Returns the path as it is typed in the present folder; the whole path where the two lie on different drives."""
    try:
        return os.path.relpath(path)
    except ValueError:
        return str(path)
