"""Which cases are made: tiers, how many of each, and where everything lies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from shared.errors import UserError

QUICK: Mapping[str, int] = MappingProxyType({"null": 4, "single": 6, "outside": 2, "absorbed": 1, "confounded": 1})
"""About three minutes on two cores. It is an honest subset: the first cases of each tier, whatever they are."""

FULL: Mapping[str, int] = MappingProxyType(
    {
        "null": 200,
        "null_nuisance": 100,
        "single": 100,
        "pair": 54,
        "confounded": 28,
        "absorbed": 16,
        "outside": 36,
        "artefact": 12,
        "twin_null": 20,
        "frames": 9,
    }
)
"""Less than three hours on two cores. The gate of false alarms is about 300 nulls; every single effect comes at each of
the four strengths, every pair and every kind of what is confounded, absorbed or outside three or four times.
"""
NULLS = ("null", "null_nuisance")
THROUGH = ("twin_null", "frames")
"""The tiers that go through everything: MuJoCo, frames (the second one), tracker, bus and recorder."""


@dataclass(frozen=True, kw_only=True)
class Protocol:
    """The tiers with their numbers of cases, the generator's seed, and the folder that holds everything.

    The keys lie in a folder beside the cases, not in it: the tool is given paths of the cases only.
    """

    tiers: Mapping[str, int]
    seed: int
    out: Path

    def cases(self, tier: str) -> Path:
        """The folder of a tier's recordings."""
        return self.out / "cases" / tier

    def key(self, tier: str) -> Path:
        """The folder of a tier's key and hash."""
        return self.out / "keys" / tier

    @property
    def seals(self) -> Path:
        """The file of the hashes that were written down before the tool ran."""
        return self.out / "seals.json"

    def result(self, tier: str, case: str) -> Path:
        """What the tool said of a case."""
        return self.out / "results" / tier / f"{case}.json"

    def refit(self, tier: str, case: str) -> Path:
        """The oracle's and the rivals' fits of a case."""
        return self.out / "refits" / tier / f"{case}.json"


def tiers_of(names: str | None, cases: int | None, *, quick: bool) -> dict[str, int]:
    """The tiers that were asked for, in the protocol's order; `name:12` asks for so many cases of one.

    Raises:
        UserError: for an unknown tier or a number of cases below 1.
    """
    chosen = dict(_counted(name) for name in (names or "").split(",") if name)
    unknown = [name for name in chosen if name not in FULL]
    if unknown:
        raise UserError(f"Expected tiers among {', '.join(FULL)}, got {', '.join(unknown)}")
    if cases is not None and cases < 1:
        raise UserError(f"Expected 1 or more for --cases, got {cases}")
    sizes = QUICK if quick else FULL
    wanted = [name for name in FULL if name in chosen] if chosen else list(sizes)
    return {name: chosen.get(name) or cases or sizes.get(name, 2) for name in wanted}


def _counted(word: str) -> tuple[str, int | None]:
    """A tier's name, and how many cases of it, if that is said."""
    name, _, count = word.partition(":")
    if ":" in word and not (count.isdecimal() and int(count) > 0):
        raise UserError(f"Expected a number of cases of 1 or more after the colon of --tier {word}, as in single:54")
    return name, int(count) if count else None
