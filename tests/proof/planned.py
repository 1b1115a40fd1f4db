"""Families that have no generator of their own: they plan their cases, and write each into a folder."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.proof.families import Family


@dataclass(frozen=True, kw_only=True)
class Plan:
    """A case before it is written: a name that tells nothing, its line of the key, and what it is written from."""

    id: str
    entry: dict[str, Any]
    made_from: Any


class PlannedFamily(Family):
    """A family that plans its cases and writes each into a folder of its own."""

    @abstractmethod
    def plan(self, tier: str, index: int, *, seed: int) -> Plan:
        """The plan of a tier's case number `index`; the same arguments give the same plan."""

    @abstractmethod
    def write(self, plan: Plan, folder: Path, *, key: Path) -> None:
        """Writes session.mcap or table.csv, whole or not at all, and a rig.toml before it, if it has one.

        What else the generator records of a case goes into the folder of the key.
        """

    def generator(self) -> list[str]:
        """The one that all such families share."""
        return ["tests.proof.writing", self.name]


def entry_of(
    tier: str, *, answer: str = "none", effects: Sequence[Mapping[str, Any]] = (), **more: Any
) -> dict[str, Any]:
    """A line of the key, as tests/concealed writes it."""
    return {"tier": tier, "answer": answer, "effects": list(effects), "places": [], "design": {}, **more}
