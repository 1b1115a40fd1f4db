"""A recording in several files: `NAME.mcap`, then `NAME.part002.mcap`, `NAME.part003.mcap` and so on beside it.

Each part is a whole recording, with schemas, metadata and attachments of its own, so that any MCAP program reads it.
The metadata record `part` says its number, how many messages the parts before it hold, and in which file it goes on.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable
from pathlib import Path

PARTIAL = ".partial"
METADATA = "part"
NUMBER, BEFORE, CONTINUED = "number", "messages_before", "continued"
"""The names in the metadata record `part`."""
_PART = re.compile(r"^(.*)\.part(\d{3,})\.mcap$")


def partial_path(path: Path) -> Path:
    """Returns the name of a recording's file while it grows."""
    return path.with_name(path.name + PARTIAL)


def part_path(first: Path, number: int) -> Path:
    """Returns the file of a recording's part of that number; the first one has the recording's own name."""
    return first if number == 1 else first.with_name(f"{first.name.removesuffix('.mcap')}.part{number:03d}.mcap")


def number_of(name: str) -> int:
    """Returns the number of the part that a file is by its name: 1 for a recording, or for the first of its parts."""
    found = _PART.match(name)
    return int(found[2]) if found else 1


def first_name(name: str) -> str:
    """Returns the name of the file with which the recording begins."""
    found = _PART.match(name)
    return f"{found[1]}.mcap" if found else name


def files_of(first: Path) -> list[Path]:
    """Returns the files of a recording that are there, in order, without a gap."""
    found = [first]
    while number_of(first.name) == 1 and (after := part_path(first, len(found) + 1)).is_file():
        found.append(after)
    return found


def later_files(first: Path) -> list[Path]:
    """Returns the files that have names of later parts of a recording, those that broke off, too."""
    stem = first.name.removesuffix(".mcap")
    names = (path for path in first.parent.glob("*.part*.mcap*") if path.name.startswith(f"{stem}.part"))
    return sorted(path for path in names if number_of(path.name.removesuffix(PARTIAL)) > 1)


def firsts(names: Iterable[str]) -> list[str]:
    """Returns the names without later parts of a recording that is among them: they are read with their first part."""
    all_of_them = list(names)
    known = set(all_of_them)
    return [name for name in all_of_them if first_name(name) == name or first_name(name) not in known]


def sha256_of(first: Path) -> str:
    """Returns the SHA-256 of a recording's bytes, of all its parts one after another.

    Raises:
        OSError: if they cannot be read.
    """
    found = hashlib.sha256()
    for path in files_of(first):
        with path.open("rb") as file:
            while block := file.read(1 << 20):
                found.update(block)
    return found.hexdigest()
