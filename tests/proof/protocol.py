"""The protocol tells which cases of a family are made, and where everything of them lies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from shared.errors import UserError


@dataclass(frozen=True, kw_only=True)
class Protocol:
    """The tiers of a family with their numbers of cases, the generator's seed, and the folder that holds everything.

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
        """Returns the path of what the tool said of a case."""
        return self.out / "results" / tier / f"{case}.json"

    def refit(self, tier: str, case: str) -> Path:
        """The oracle's and the rivals' fits of a case."""
        return self.out / "refits" / tier / f"{case}.json"


def tiers_of(
    full: Mapping[str, Mapping[str, int]],
    quick: Mapping[str, Mapping[str, int]],
    *,
    names: str | None,
    cases: int | None,
    is_quick: bool,
) -> dict[str, dict[str, int]]:
    """The tiers that were asked for, by family (the keys of `full` and `quick`), in the families' order.

    `names` is a list as in `null:12,own/single`: so many cases of a tier in every family that has it, or in one.
    Without it every family has the tiers of its protocol; a family of which nothing is asked is left out.

    Raises:
        UserError: for an unknown tier or a number of cases below 1.
    """
    chosen = dict(_counted(name) for name in (names or "").split(",") if name)
    known = {word for family, tiers in full.items() for tier in tiers for word in (tier, f"{family}/{tier}")}
    if unknown := [name for name in chosen if name not in known]:
        raise UserError(f"Expected tiers among {', '.join(sorted(known))}, got {', '.join(unknown)}")
    if cases is not None and cases < 1:
        raise UserError(f"Expected 1 or more for --cases, got {cases}")
    asked: dict[str, dict[str, int]] = {}
    for family, tiers in full.items():
        sizes = quick[family] if is_quick else tiers
        wanted = [tier for tier in tiers if {tier, f"{family}/{tier}"} & chosen.keys()] if chosen else list(sizes)
        counts = {tier: chosen.get(f"{family}/{tier}") or chosen.get(tier) for tier in wanted}
        asked[family] = {tier: count or cases or sizes.get(tier, 2) for tier, count in counts.items()}
    return {family: tiers for family, tiers in asked.items() if tiers}


def _counted(word: str) -> tuple[str, int | None]:
    """A tier's name, and how many cases of it, if that is said."""
    name, _, count = word.partition(":")
    if ":" in word and not (count.isdecimal() and int(count) > 0):
        raise UserError(f"Expected a number of cases of 1 or more after the colon of --tier {word}, as in single:54")
    return name, int(count) if count else None
