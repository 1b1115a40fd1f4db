"""The rules, each with what it says when it is switched off; nothing in the station knows of this.

A rule is a function (or property) of the station that can refuse, replace, demote or add a claim. Switched off, it
gives the answer that leaves everything as it is. It fires where its own answer is another one.
"""

from __future__ import annotations

import importlib
import math
from collections import Counter
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from station.diagnosis import thresholds

Off = Callable[..., Any]


@dataclass(frozen=True, kw_only=True)
class Rule:
    """A rule: where it stands (`module:name`, or `module:class.name`), and its answer when it is off.

    `differs` says whether two answers differ; `late` is a rule that only weighs what a search has found; `is_property`:
    the name is a property's; `number`: it is a threshold, and `off` gives another value.
    """

    name: str
    places: tuple[str, ...]
    off: Off
    differs: Callable[[Any, Any], bool] = lambda one, other: bool(one != other)
    late: bool = False
    is_property: bool = False
    number: bool = False


def _false(*_: Any, **__: Any) -> bool:
    return False


def _true(*_: Any, **__: Any) -> bool:
    return True


def _one(*_: Any, **__: Any) -> float:
    return 1.0


def _empty(*_: Any, **__: Any) -> list[Any]:
    return []


def _as_they_are(_: Any, candidates: Sequence[Any]) -> list[Any]:
    return list(candidates)


def _against(one: Any, _: Any) -> bool:
    return any(candidate.against > 0 for candidate in one)


def _full_cost(fitter: Any, _found: Any, _effect: Any, _parameter: Any) -> float:
    return math.log(max(fitter.evidence.used(), 2))


S = "station.diagnosis.search."
RULES: tuple[Rule, ...] = (
    Rule(name="misfit of a law", places=(S + "search:is_misfit_of_law",), off=_false),
    Rule(name="further name by chance", places=(S + "comparison:Comparison.is_further",), off=_false, is_property=True),
    Rule(name="trifle", places=(S + "search:is_trifle", S + "comparison:is_trifle"), off=_false),
    Rule(name="trifling place", places=(S + "search:is_trifling_place",), off=_false),
    Rule(
        name="paths judge laws",
        places=(S + "search:with_path_evidence", S + "comparison:with_path_evidence"),
        off=_as_they_are,
        differs=_against,
    ),
    Rule(name="pairs by partners", places=(S + "search:_partnered",), off=_empty),
    Rule(name="no size at its bound", places=(S + "candidates:_inside",), off=_true),
    Rule(name="shapes cost less", places=(S + "candidates:Fitter._cost",), off=_full_cost),
    Rule(name="overdispersion", places=(S + "candidates:overdispersion",), off=_one),
    Rule(name="temperature", places=(S + "comparison:temperature",), off=_one, late=True),
    Rule(
        name="held-out gain",
        places=("station.diagnosis.result:HeldOutGain.real",),
        off=_true,
        late=True,
        is_property=True,
    ),
)


def another(word: str) -> Rule:
    """A threshold with another value, as `NAME=VALUE`."""
    name, _, value = word.partition("=")
    if name not in thresholds.table() or not value:
        raise ValueError(f"expected a rule's name or NAME=VALUE of a threshold, got {word}")
    return Rule(name=word, places=(f"station.diagnosis.thresholds:{name}",), off=lambda: float(value), number=True)


def _holder(place: str) -> tuple[Any, str]:
    module, _, path = place.partition(":")
    holder: Any = importlib.import_module(module)
    *outer, name = path.split(".")
    for one in outer:
        holder = getattr(holder, one)
    return holder, name


@contextmanager
def _patched(changes: Sequence[tuple[Any, str, Any]]) -> Generator[None]:
    kept = [(holder, name, vars(holder)[name]) for holder, name, _ in changes]
    for holder, name, new in changes:
        setattr(holder, name, new)
    try:
        yield
    finally:
        for holder, name, old in kept:
            setattr(holder, name, old)


@contextmanager
def without(rule: Rule) -> Generator[None]:
    """The station without a rule."""
    new = rule.off() if rule.number else property(rule.off) if rule.is_property else rule.off
    with _patched([(*_holder(place), new) for place in rule.places]):
        yield


@contextmanager
def watched(fired: Counter[str]) -> Generator[None]:
    """The station as it is; `fired` counts how often each rule gave another answer than when it is off."""
    changes: list[tuple[Any, str, Any]] = []
    for rule in RULES:
        for place in rule.places:
            holder, name = _holder(place)
            changes.append((holder, name, _watching(rule, vars(holder)[name], fired)))
    with _patched(changes):
        yield


def _watching(rule: Rule, known: Any, fired: Counter[str]) -> Any:
    own = known.fget if rule.is_property else known

    def watch(*arguments: Any, **named: Any) -> Any:
        answer = own(*arguments, **named)
        kept = list(answer) if isinstance(answer, Iterator) else answer
        fired[rule.name] += rule.differs(kept, rule.off(*arguments, **named))
        return kept

    return property(watch) if rule.is_property else watch
