"""Opens the sealed key: what was concealed in each case."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from shared.errors import UserError
from station.prove.protocol import Protocol


@dataclass(frozen=True, kw_only=True)
class Concealed:
    """One effect of a case: its strength in detection limits (nan where none is defined) and its parameters.

    `where` are the places (phase, covariate) where it shows, the surest first, in the generator's words; `signs` are
    by run (by its number) how many standard errors it moves that run's onset and path.
    """

    id: str
    strength: float
    parameters: Mapping[str, float]
    where: tuple[tuple[str, str], ...] = ()
    onset_signs: Mapping[int, float]
    path_signs: Mapping[int, float]


@dataclass(frozen=True, kw_only=True)
class Truth:
    """The line of the key of one case."""

    id: str
    tier: str
    answer: str
    effects: tuple[Concealed, ...]
    members: tuple[str, ...]
    """The ids of the class that the design cannot split; empty in other tiers."""
    next: tuple[tuple[str, ...], ...]
    """Features of a protocol, any of which splits it; all words of one entry are needed together."""
    design: Mapping[str, Any]
    """The session's protocol, in the generator's words."""

    @property
    def ids(self) -> frozenset[str]:
        """Ids of the concealed effects."""
        return frozenset(effect.id for effect in self.effects)

    @property
    def weakest(self) -> float:
        """The smallest strength; infinite without an effect."""
        return min((effect.strength for effect in self.effects), default=math.inf)


def open_key(protocol: Protocol, tier: str) -> dict[str, Truth]:
    """The truths of a tier by case.

    Raises:
        UserError: if the key is not the one whose hash was written down before the tool ran.
    """
    path = protocol.key(tier) / "key.json"
    seals: dict[str, str] = json.loads(protocol.seals.read_text("utf-8"))
    found = hashlib.sha256(path.read_bytes()).hexdigest()
    if found != seals.get(tier):
        raise UserError(
            f"Expected the key {path} with the hash {seals.get(tier)} that was sealed in {protocol.seals}, got {found}"
        )
    cases: dict[str, Any] = json.loads(path.read_text("utf-8"))["cases"]
    return {name: truth_of(name, entry) for name, entry in cases.items()}


def truth_of(name: str, entry: Mapping[str, Any]) -> Truth:
    """A line of the key."""
    places = {place["effect"]: place for place in entry["places"]}
    told = entry.get("class", {})
    return Truth(
        id=name,
        tier=entry["tier"],
        answer=entry["answer"],
        effects=tuple(_concealed(effect, places.get(effect["id"], {})) for effect in entry["effects"]),
        members=tuple(told.get("members", ())),
        next=tuple(tuple(words) for words in (told.get("next") or entry.get("next") or ())),
        design=entry["design"],
    )


def _concealed(effect: Mapping[str, Any], place: Mapping[str, Any]) -> Concealed:
    runs = [int(run) for run in place.get("runs", ())]
    limit = float(effect["detection_limit"])
    return Concealed(
        id=effect["id"],
        strength=float(effect["strength"]) if math.isfinite(limit) else math.nan,
        parameters={name: float(value) for name, value in effect["parameters"].items()},
        where=tuple((one["phase"], one["covariate"]) for one in place.get("where", ())),
        onset_signs=dict(zip(runs, place.get("onset_sigmas", ()), strict=False)),
        path_signs=dict(zip(runs, place.get("path_sigmas", ()), strict=False)),
    )
