"""Looks into .rrd files with Rerun's own command line."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

from station.view import viewer
from tests.patience import PATIENCE_S


def rerun(*words: str | Path) -> str:
    """Returns what the command prints; fails when it fails."""
    command = [viewer.binary(), *(str(word) for word in words)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def rows_by_entity(path: Path) -> dict[str, int]:
    """Returns how many rows each entity of recordings and blueprints has."""
    rows: dict[str, int] = {}
    for count, entity in re.findall(r"^Chunk\(\S+\) with (\d+) rows \([^)]*\) - (/\S*)", _printed(path), re.MULTILINE):
        rows[entity] = rows.get(entity, 0) + int(count)
    return rows


def _printed(path: Path) -> str:
    return rerun("rrd", "print", path)


def has_blueprint(path: Path) -> bool:
    """True if a layout is embedded, and made the active one."""
    text = _printed(path)
    return re.search(r"StoreId\(\s*Blueprint,", text) is not None and "BlueprintActivationCommand" in text
