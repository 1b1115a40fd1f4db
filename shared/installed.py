"""The installation of Repose: its version, and the extra that brings a missing package."""

from __future__ import annotations

import importlib.metadata
import platform
import re
import sys
from collections import Counter
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from shared.errors import UserError

DISTRIBUTION = "repose-friction"
"""The name on the package index; pyproject.toml has it, too, and a test compares them."""
_BROUGHT_BY = {
    "collada": "pycollada",
    "PIL": "pillow",
    "cv2": "opencv-python-headless",
    "google": "protobuf",
    "rerun": "rerun-sdk",
    "rerun_cli": "rerun-sdk",
    "serial": "pyserial",
    "zenoh": "eclipse-zenoh",
}
"""Distributions whose names differ from what is imported from them."""


def version() -> str:
    """Returns the version of this software; "unknown" where it runs without being installed."""
    try:
        return importlib.metadata.version(DISTRIBUTION)
    except importlib.metadata.PackageNotFoundError:
        return "unknown"


def sentence_of(missing: ModuleNotFoundError) -> str | None:
    """Returns a sentence that says what to install; None if no extra brings the package, which is a fault of ours."""
    root = (missing.name or "").partition(".")[0]
    wanted = _normal(_BROUGHT_BY.get(root, root))
    found = [line for line in _requirements() if _normal(_name(line)) == wanted]
    if not found:
        return None
    size_of = Counter(map(_extra, _requirements()))
    requirement = min(found, key=lambda line: size_of[_extra(line)])  # not "all", which has what the others have
    sentence = f"Expected the package {wanted}, which is not installed; run: {to_install(_extra(requirement))}"
    if "platform_machine" in requirement:
        sentence += f" (it comes only where it has a wheel; this is {platform.machine()})"
    return sentence


@contextmanager
def missing_as_user_error() -> Generator[None]:
    """Turns the absence of a package that an extra brings into a user's mistake; it is a decorator, too.

    Raises:
        UserError: with the sentence that says what to install.
    """
    try:
        yield
    except ModuleNotFoundError as missing:
        sentence = sentence_of(missing)
        if sentence is None:
            raise
        raise UserError(sentence) from missing


def to_install(extra: str) -> str:
    """Returns the command that adds an extra to this environment, whichever program made it."""
    what = f'"{DISTRIBUTION}[{extra}]"' if extra else f'"{DISTRIBUTION}"'
    made_by = Path(sys.prefix).parts
    if "pipx" in made_by:
        return f"pipx runpip {DISTRIBUTION} install {what}"
    if {"uv", "tools"} <= set(made_by):
        return f"uv pip install --python {sys.executable} {what}"
    return f"pip install {what}"


def _requirements() -> list[str]:
    try:
        return importlib.metadata.requires(DISTRIBUTION) or []
    except importlib.metadata.PackageNotFoundError:
        return []


def _extra(requirement: str) -> str:
    """Returns the extra that a requirement belongs to; "" if every installation has it."""
    found = re.search(r"extra == ['\"]([\w-]+)['\"]", requirement)
    return found[1] if found else ""


def _name(requirement: str) -> str:
    """Returns the name with its own extras: an installation without mujoco does not need mujoco[sysid]."""
    return re.split(r"[^]\w.[-]", requirement, maxsplit=1)[0]


def _normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()
