"""An index as a forger writes it: whole and with a right checksum, but it names records that are not as it says."""

from __future__ import annotations

from dataclasses import fields, replace
from random import Random
from typing import Any

from station.recording.mcap_file import McapFile
from tests.fuzz.change import INTEGERS


def forge(random: Random, file: McapFile) -> None:
    """Changes a number of some entries of a file's index, or repeats an entry, before the file is finished."""
    file.flush()
    lists: list[list[Any]] = [
        file._chunk_indexes,  # pyright: ignore[reportPrivateUsage]
        file._attachment_indexes,  # pyright: ignore[reportPrivateUsage]
        file._metadata_indexes,  # pyright: ignore[reportPrivateUsage]
    ]
    entries = random.choice([one for one in lists if one] or [[]])
    if not entries:
        return
    if random.random() < 0.2:
        entries += [random.choice(entries)] * random.choice((1, 1000))
        return
    numbers = [field.name for field in fields(entries[0]) if isinstance(getattr(entries[0], field.name), int)]
    name = random.choice(numbers)
    for place in random.sample(range(len(entries)), random.choice((1, len(entries)))):
        entries[place] = replace(entries[place], **{name: _other(random, getattr(entries[place], name))})


def _other(random: Random, value: int) -> int:
    """Another number of 64 bits: a hostile one, or one near by."""
    found = random.choice((value + 1, value - 1, 2 * value, *(number for number in INTEGERS if number >= 0)))
    return min(max(0, found), 2**64 - 1)
