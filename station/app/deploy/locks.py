"""Reads a lock file: exact versions with the hashes of the wheels that may be used."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from shared.errors import UserError

_PIN = re.compile(r"^([A-Za-z0-9][A-Za-z0-9._-]*)==([^\s;\\]+)")
_HASH = re.compile(r"--hash=sha256:([0-9a-f]{64})")


@dataclass(frozen=True)
class Pin:
    """One dependency at one version; `hashes` are the SHA-256 of its allowed files."""

    name: str
    version: str
    hashes: frozenset[str]


def normal(name: str) -> str:
    """Returns a distribution's name in the one spelling that compares (PEP 503)."""
    return re.sub(r"[-_.]+", "-", name).lower()


def read_lock(path: Path) -> tuple[Pin, ...]:
    """Reads the pins of a lock file as `uv pip compile --generate-hashes` writes it.

    Raises:
        UserError: if it is missing, or a line is not an exact pin with a hash.
    """
    try:
        text = path.read_text(encoding="utf-8").replace("\\\n", " ")
    except OSError as error:
        raise UserError(f"Expected a lock file at {path}, but it cannot be read: {error.strerror}") from error
    pins: list[Pin] = []
    for line in text.splitlines():
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        pin, hashes = _PIN.match(line), frozenset(_HASH.findall(line))
        if pin is None or not hashes:
            raise UserError(f"{path}: expected lines of 'name==version --hash=sha256:…', got '{line.strip()[:60]}'")
        pins.append(Pin(normal(pin.group(1)), pin.group(2), hashes))
    if not pins:
        raise UserError(f"{path}: expected at least one pinned dependency, got none")
    return tuple(pins)
