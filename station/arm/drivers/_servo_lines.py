"""The lines between a servo tilt stage and its driver; deploy/tilt_stage/README.md is their one description.

A line is ASCII words, `*`, four hexadecimal digits of the CRC-16/XMODEM of what stands before, and a newline.
"""

from __future__ import annotations

import binascii
import math
from dataclasses import dataclass

VERSION = 1
IDLE, FOLLOWING, HELD, LEVELLING = "I", "F", "H", "L"
MEANING = {IDLE: "it is stopped", HELD: "it heard nothing and holds", LEVELLING: "it heard nothing and levels"}
"""The states in which a stage does not follow set-points, in words."""
PER_DEGREE = 1_000_000
"""Angles are integers in millionths of a degree."""
UNIT_RAD = math.pi / 180 / PER_DEGREE
_LONGEST = 512


@dataclass(frozen=True, slots=True)
class Hello:
    """A stage's answer to `?`: the limits of each axis (1e-6 degrees), and whether it knows how it stands.

    `life` is the name that it was asked by; 0 of a board with a sketch from before lives had names.
    """

    version: int
    placed: bool
    limits: tuple[tuple[int, int], ...]
    life: int = 0


@dataclass(frozen=True, slots=True)
class StageReport:
    """A stage's report: its state, the number of the set-point that it took last, angles and speeds per axis.

    `life` is the name of the board's life; 0 while it has been given none.
    """

    state: str
    number: int
    angles: tuple[int, ...]
    speeds: tuple[int, ...]
    life: int = 0


def line(*words: object) -> bytes:
    """Returns the line of these words."""
    body = " ".join(map(str, words)).encode("ascii")
    return body + b"*%04X\n" % binascii.crc_hqx(body, 0)


class Lines:
    """Takes bytes as they come and gives the words of each whole, undamaged line."""

    def __init__(self) -> None:
        self._rest = b""

    def take(self, data: bytes) -> list[list[str]]:
        """Returns the lines that these bytes end; a damaged line is no line."""
        *whole, self._rest = (self._rest + data).split(b"\n")
        self._rest = self._rest[-_LONGEST:]
        return [words for words in map(_words, whole) if words]


def _words(raw: bytes) -> list[str]:
    body, star, crc = raw.strip().rpartition(b"*")
    if not star or crc.upper() != b"%04X" % binascii.crc_hqx(body, 0):
        return []
    return body.decode("ascii", "replace").split()


def hello(words: list[str]) -> Hello | None:
    """Returns the answer to `?` in `I version axes placed lower upper… [life]`; None if they are something else."""
    numbers = _numbers(words[1:]) if words[0] == "I" else []
    if len(numbers) < 3 or (end := 3 + 2 * numbers[1]) not in (len(numbers), len(numbers) - 1):
        return None
    limits = tuple(zip(numbers[3:end:2], numbers[4:end:2], strict=True))
    return Hello(numbers[0], bool(numbers[2]), limits, *numbers[end:])


def stage_report(words: list[str], *, axes: int) -> StageReport | None:
    """Returns the report in the words `P state number angle speed… [life]`; None if they are something else."""
    numbers = _numbers(words[2:]) if words[0] == "P" else []
    if (end := 1 + 2 * axes) not in (len(numbers), len(numbers) - 1):
        return None
    return StageReport(words[1], numbers[0], tuple(numbers[1:end:2]), tuple(numbers[2:end:2]), *numbers[end:])


def _numbers(words: list[str]) -> list[int]:
    try:
        return [int(word) for word in words]
    except ValueError:
        return []
