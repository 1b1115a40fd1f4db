"""A case with every rule, or without one: which names are claimed, and how that compares with the right ones."""

from __future__ import annotations

import json
import time
from collections import Counter
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import cloudpickle
import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.predict.folds import Fold, assigned, named
from station.diagnosis.predict.quality import sifted
from station.diagnosis.search.posterior import called, posteriors_of
from station.diagnosis.search.search import Search, in_stages, search
from station.physics.catalogue import catalogue
from station.physics.model import Model
from tests.benchmarks.knock_out.cases import Case, evidence_of_case
from tests.benchmarks.knock_out.rules import Rule, watched, without

SEED = 1


@dataclass(frozen=True, kw_only=True)
class Claim:
    """A name that is claimed, those that cannot be told from it, and its probability."""

    name: str
    alike: tuple[str, ...]
    probability: float


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """The claims of a case, what is listed and refused, how often each rule fired, and processor seconds."""

    claims: tuple[Claim, ...]
    refused: tuple[Claim, ...]
    global_p: float
    fired: dict[str, int] = field(default_factory=dict[str, int])
    seconds: float = 0.0

    def worth(self, case: Case) -> float:
        """1 for each right name, 1/2 where it is only in the class; minus 1 for each claim that is neither."""
        total, left = 0.0, set(case.names)
        for claim in self.claims:
            if claim.name in left:
                total += 1.0
                left.discard(claim.name)
            elif left & set(claim.alike):
                total += 0.5
                left -= set(claim.alike)
            else:
                total -= 1.0
        return total

    def told(self) -> str:
        """One line."""
        said = [f"{one.name} {one.probability:.2f}" + ("~" if len(one.alike) > 1 else "") for one in self.claims]
        refused = [f"({one.name} {one.probability:.2f})" for one in self.refused]
        return ", ".join([*said, *refused]) or "nothing"


Found = tuple[Evidence, Search, tuple[Fold, ...]]


def searched(evidence: Evidence, like: Found | None = None) -> Found:
    """The search and its folds, as `station diagnose` makes them; the folds of `like`, if the same names are found.

    A search must not begin where another ended: it would be spared the bad maxima that a rule is there for.
    """
    rng, start = np.random.default_rng(SEED), Model(mu_s=0.4)
    effects = tuple(catalogue().values())
    staged = in_stages(evidence, effects, start=start, rng=rng, progress=lambda _: None)
    found = search(staged, rng, lambda _: None)
    if like is not None and {one.id for one in found.found} == {one.id for one in like[1].found}:
        return evidence, found, like[2]
    return evidence, found, named(evidence, effects, found, fold=assigned(evidence, rng), seed=SEED, jobs=1)


def weighed(found: Found) -> tuple[list[Claim], list[Claim]]:
    """The names that are claimed, and those that are listed beside them."""
    evidence, search_, folds = found
    posteriors = posteriors_of(search_)
    gains = sifted(evidence, folds, posteriors.classes).gains
    listed = [
        (Claim(name=called(name), alike=posteriors.classes[name], probability=float(chance)), gains[name].real)
        for name, chance in posteriors.effects.items()
    ]
    listed += [(Claim(name="other", alike=("other",), probability=float(chance)), True) for chance in posteriors.places]
    claims = [claim for claim, real in listed if real and claim.probability > thresholds.EVEN]
    return claims, [claim for claim, real in listed if not (real and claim.probability > thresholds.EVEN)]


def outcome(case: Case, folder: Path, rule: Rule | None = None) -> Outcome:
    """Returns the outcome of a case without a rule, or with all; what has been done before is read from `folder`."""
    kept = folder / ("all" if rule is None else rule.name.replace(" ", "_")) / f"{case.id}.json"
    if kept.exists():
        return _read(json.loads(kept.read_text("utf-8")))
    began, fired = time.process_time(), Counter[str]()
    with watched(fired) if rule is None else without(rule):
        found = _found(case, folder, anew=rule is not None and not rule.late)
        claims, refused = weighed(found)
    done = Outcome(
        claims=tuple(claims),
        refused=tuple(refused),
        global_p=found[1].global_p,
        fired=dict(fired),
        seconds=time.process_time() - began,
    )
    kept.parent.mkdir(parents=True, exist_ok=True)
    kept.write_text(json.dumps(asdict(done)), encoding="utf-8")
    return done


def _found(case: Case, folder: Path, *, anew: bool) -> Found:
    """The search with all rules is kept: a rule that only weighs what it found needs no other."""
    kept = folder / "found" / f"{case.id}.pickle"
    like: Found | None = cloudpickle.loads(kept.read_bytes()) if kept.exists() else None
    if like is not None and not anew:
        return like
    found = searched(evidence_of_case(case, folder / "evidence"), like if anew else None)
    if not anew:
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_bytes(cloudpickle.dumps(found))
    return found


def _read(told: dict[str, Any]) -> Outcome:
    def listed(key: str) -> tuple[Claim, ...]:
        return tuple(Claim(**one | {"alike": tuple(one["alike"])}) for one in told.pop(key))

    return Outcome(claims=listed("claims"), refused=listed("refused"), **told)
