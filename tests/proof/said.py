"""The answer of the tool to a case is read from its JSON as any user would read it."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from shared.errors import UserError

CLAIMS = ("supported", "indistinguishable")


@dataclass(frozen=True, kw_only=True)
class Said:
    """The answer of one case; `fault` is the tool's own failure, None where there was none."""

    answer: Mapping[str, Any]
    wall_s: float
    fault: str | None = None

    @property
    def claimed(self) -> list[Mapping[str, Any]]:
        """The effects that are claimed, the likeliest first."""
        return [effect for effect in self.answer.get("effects", ()) if effect["verdict"] in CLAIMS]

    @property
    def first(self) -> str:
        """The first name: an id, `other`, `none`, or `fault`."""
        if self.fault is not None:
            return "fault"
        claimed = self.claimed
        return str(claimed[0]["id"]) if claimed else "none"

    @property
    def names(self) -> list[str]:
        """The claimed ids of the catalogue."""
        return [str(effect["id"]) for effect in self.claimed if effect["id"] != "other"]

    @property
    def within(self) -> frozenset[str]:
        """Every id that stands in a claimed class."""
        return frozenset(name for effect in self.claimed for name in effect["class"])

    @property
    def confident(self) -> list[str]:
        """Names that are said without any doubt: supported, and alone in their class."""
        return [
            str(effect["id"])
            for effect in self.claimed
            if effect["verdict"] == "supported" and len(effect["class"]) == 1 and effect["id"] != "other"
        ]

    @property
    def untestable(self) -> dict[str, str]:
        """Reasons by id."""
        return {one["id"]: one["reason"] for one in self.answer.get("untestable", ())}

    @property
    def runs(self) -> int:
        """The number of runs that were used."""
        return int(self.answer.get("runs", {}).get("used", 0))


def read_said(path: Path, *, digest: str) -> Said:
    """Reads a result.

    Raises:
        UserError: if another version of the tool wrote it.
    """
    kept = json.loads(path.read_text("utf-8"))
    if kept["tool"] != digest:
        raise UserError(
            f"Expected results of the tool as it is now ({digest}), got {path} of {kept['tool']}: one run only, no "
            "retries; choose a new folder for the new version"
        )
    answer = kept["answer"]
    return Said(answer=answer, wall_s=float(kept["wall_s"]), fault=answer.get("error"))


def number(value: object) -> float:
    """A number of the JSON; what does not exist is nan."""
    return float(value) if isinstance(value, int | float) else math.nan
