"""A case's truth is what was concealed in it; the sealed key says it."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from itertools import permutations
from types import MappingProxyType
from typing import Any

from shared.errors import UserError
from tests.proof.protocol import Protocol

STRONG = 2.0 * (1.0 - 1e-3)
"""Effects at twice the detection limit or more; the key has five digits."""

KINDS = ("null", "single", "pair", "confounded", "absorbed", "outside", "artefact")
"""The kinds of cases, by what they ask of the tool; a tier of another name says it case by case."""
_KIND_OF: Mapping[str, str] = MappingProxyType({"null_nuisance": "null", "twin_null": "null"})


@dataclass(frozen=True, kw_only=True)
class Concealed:
    """One effect of a case: its strength in the family's own unit (nan where none is defined) and its parameters.

    `also` are further names that are as right, and `strong` says whether a tool should find it without doubt. `where`
    are the places (phase, covariate) where it shows, the surest first, in the generator's words; `signs` are
    by run (by its number) how many standard errors it moves that run's onset and path. A generator that records by how
    much an effect acted, and no covariate, says that in `acted` instead, by phase and run.
    """

    id: str
    strength: float
    parameters: Mapping[str, float]
    where: tuple[tuple[str, str], ...] = ()
    onset_signs: Mapping[int, float]
    path_signs: Mapping[int, float]
    also: tuple[str, ...] = ()
    strong: bool = True
    acted: Mapping[tuple[str, int], float] = field(default_factory=dict[tuple[str, int], float])

    @property
    def right(self) -> frozenset[str]:
        """Every name that is right."""
        return frozenset((self.id, *self.also))


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
    kind: str
    """One of KINDS."""

    @property
    def ids(self) -> frozenset[str]:
        """Ids of the concealed effects."""
        return frozenset(effect.id for effect in self.effects)

    @property
    def right(self) -> frozenset[str]:
        """Every name that is right for any of them."""
        return frozenset(name for effect in self.effects for name in effect.right)

    def each_named(self, names: Collection[str]) -> bool:
        """True if each concealed effect has a name of its own among these."""
        drawn = permutations(names, len(self.effects))
        return any(all(n in effect.right for n, effect in zip(some, self.effects, strict=True)) for some in drawn)

    @property
    def weakest(self) -> float:
        """The smallest strength; infinite without an effect."""
        return min((effect.strength for effect in self.effects), default=math.inf)


def open_key(protocol: Protocol, tier: str) -> dict[str, Any]:
    """Returns what the key of a tier says.

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
    told: dict[str, Any] = json.loads(path.read_text("utf-8"))
    return told


def truth_of(name: str, entry: Mapping[str, Any]) -> Truth:
    """A line of the key, as tests/concealed writes it."""
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
        kind=_kind(entry),
    )


def _kind(entry: Mapping[str, Any]) -> str:
    """Returns the kind by the tier's name, or by whether anything is concealed."""
    kind = _KIND_OF.get(entry["tier"], entry["tier"])
    return kind if kind in KINDS else "single" if entry["effects"] else "null"


def _concealed(effect: Mapping[str, Any], place: Mapping[str, Any]) -> Concealed:
    runs = [int(run) for run in place.get("runs", ())]
    strength = float(effect["strength"]) if math.isfinite(float(effect["detection_limit"])) else math.nan
    return Concealed(
        id=effect["id"],
        also=tuple(effect.get("also", ())),
        strength=strength,
        strong=not strength < STRONG,
        parameters={name: float(value) for name, value in effect["parameters"].items()},
        where=tuple((one["phase"], one["covariate"]) for one in place.get("where", ())),
        onset_signs=dict(zip(runs, place.get("onset_sigmas", ()), strict=False)),
        path_signs=dict(zip(runs, place.get("path_sigmas", ()), strict=False)),
    )
