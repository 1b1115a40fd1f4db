"""The rig itself, simulated (tests/frames): MuJoCo, an injected effect, frames, the tracker, the recorder."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from tests.proof.families import Family
from tests.proof.families.own import EXACT, INEXACT
from tests.proof.parameters import Map


class Frames(Family):
    """Its effects are counted in no detection limit: all of them are meant to be plain in 40 runs."""

    name: ClassVar[str] = "frames"
    title: ClassVar[str] = "twin through frames"
    place: ClassVar[int] = 20
    quick: ClassVar[Mapping[str, int]] = MappingProxyType({})
    full: ClassVar[Mapping[str, int]] = MappingProxyType({"twin_null": 40, "frames": 12})

    def generator(self) -> list[str]:
        """A case of twin_null takes 20 s of a core, one of frames 90 s."""
        return ["tests.frames"]

    def maps(self) -> Mapping[str, Map]:
        """Its laws are written in the words of the first generator."""
        return EXACT

    def inexact(self) -> Mapping[str, str]:
        """See `maps`."""
        return INEXACT
