"""The versions of the packages on which an answer depends."""

from __future__ import annotations

import importlib.metadata

from shared import installed

PACKAGES = ("numpy", "scipy", "mujoco")


def versions() -> dict[str, str]:
    """Returns the versions of this program and of those packages by name."""
    return {"repose": installed.version()} | {package: importlib.metadata.version(package) for package in PACKAGES}
