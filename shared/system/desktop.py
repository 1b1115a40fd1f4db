"""The desktop: whether a window can be opened, what a program's file is called, and in which letters it prints."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TextIO

PROGRAM_SUFFIX = ".exe" if sys.platform == "win32" else ""
"""The ending of a program file's name."""

if sys.platform in ("win32", "darwin"):

    def has_display(environment: Mapping[str, str] = os.environ) -> bool:
        """True if a window can be opened here: everywhere but in a session from another machine."""
        return "SSH_CONNECTION" not in environment

else:

    def has_display(environment: Mapping[str, str] = os.environ) -> bool:
        """True if a window can be opened here."""
        return bool(environment.get("DISPLAY") or environment.get("WAYLAND_DISPLAY"))


def from_here(path: Path) -> str:
    """The path as it is typed in the present folder; the whole path where the two lie on different drives."""
    try:
        return os.path.relpath(path)
    except ValueError:
        return str(path)


class _Lasting(io.FileIO):
    """A terminal, or a pipe, that takes what is written to it after it was closed, and forgets it."""

    def write(self, data: Any, /) -> int:
        """Writes, as long as there is somebody to read it."""
        try:
            return super().write(data)
        except OSError:
            return len(memoryview(data))


def outlive_terminal() -> None:
    """Lets this process go on when its terminal is closed: it has a plate to bring back to level."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if isinstance(stream, io.TextIOWrapper):
            stream.flush()
            raw = io.BufferedWriter(_Lasting(stream.fileno(), "w", closefd=False))
            lasting = io.TextIOWrapper(raw, stream.encoding, stream.errors, line_buffering=stream.line_buffering)
            setattr(sys, name, lasting)


def print_all_letters(*streams: TextIO) -> None:
    """Has streams that know few letters (a pipe or a file on Windows: those of one language) written in UTF-8."""
    for stream in streams:
        if isinstance(stream, io.TextIOWrapper) and stream.encoding.lower().replace("-", "") != "utf8":
            stream.reconfigure(encoding="utf-8")
