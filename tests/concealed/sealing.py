"""Every generator of cases shares random numbers by origin, names that tell nothing, and keys with their hash."""

from __future__ import annotations

import hashlib
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.random import Generator, SeedSequence

Origin = tuple[int, int, int]
"""Seed, the tier's number, the case's number: what everything random in a case comes from."""


def generator(origin: Origin, part: str) -> Generator:
    """The random numbers of one part of a case: `name`, `design`, `session` or `file`, say."""
    return np.random.default_rng(SeedSequence([*origin, *part.encode()]))


def case_id(origin: Origin) -> str:
    """A name that tells nothing."""
    return generator(origin, "name").bytes(6).hex()


def finished(folder: Path) -> bool:
    """True if a case has been written."""
    return (folder / "session.mcap").exists() and (folder / "rig.toml").exists()


def sealed(key: dict[str, Any]) -> tuple[str, str]:
    """The key's text and its hash."""
    text = json.dumps(key, indent=1, sort_keys=True) + "\n"
    return text, hashlib.sha256(text.encode()).hexdigest()


def short(value: float) -> float | str:
    """Five digits; JSON knows no infinity."""
    return float(f"{value:.5g}") if math.isfinite(value) else "inf"
