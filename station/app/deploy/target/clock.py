"""Chrony on the target follows the station, so that both clocks mean the same before round trips refine it."""

from __future__ import annotations

import os
import shutil
import subprocess

from .paths import TargetPaths

_OPTIONS = "iburst minpoll 0 maxpoll 4 prefer"


def follow(paths: TargetPaths, station: str) -> bool:
    """Makes the station a source of chrony's; True if that was not so before."""
    line = f"# The station's computer; written by `station deploy`.\nserver {station} {_OPTIONS}\n"
    known = paths.clock_source
    if known.is_file() and known.read_text() == line:
        return False
    known.parent.mkdir(parents=True, exist_ok=True)
    known.write_text(line)
    _chronyc("reload", "sources")
    return True


def forget(paths: TargetPaths) -> None:
    """Takes the station out of chrony's sources."""
    if paths.clock_source.exists():
        paths.clock_source.unlink()
        _chronyc("reload", "sources")


def tracking() -> dict[str, str]:
    """Gives the words of chrony: the source that it follows and how far the clock is from it; empty without chrony."""
    parts = _chronyc("-c", "tracking").strip().split(",")
    if len(parts) < 5 or not parts[1]:
        return {}
    return {"source": parts[1], "offset_s": parts[4]}


def _chronyc(*words: str) -> str:
    path = os.environ.get("PATH", "") + ":/usr/sbin:/usr/bin"
    found = shutil.which("chronyc", path=path)
    if found is None:
        return ""
    try:
        return subprocess.run([found, *words], capture_output=True, text=True, check=False, timeout=5).stdout
    except subprocess.TimeoutExpired:
        return ""
