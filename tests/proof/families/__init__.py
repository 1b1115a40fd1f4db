"""Families of concealed cases: one file each, found by being here. One generator is one opinion of nature.

A file has one subclass of `Family`. Its generator is another process that writes recordings in the real format and,
before the first of them, the key; `generator` says how it is called. A family without a generator of its own plans and
writes its cases here (`planned.py`).
"""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from tests.proof.key import Truth, truth_of
from tests.proof.protocol import Protocol

if TYPE_CHECKING:
    from tests.proof.parameters import Map

Json = Mapping[str, Any]


class Family(ABC):
    """A family of cases: its tiers with the numbers of cases of both protocols, and how its key is read."""

    name: ClassVar[str]
    title: ClassVar[str]
    quick: ClassVar[Mapping[str, int]]
    """Cases of each tier in `make proof`; tiers that are not here are in the full protocol only."""
    full: ClassVar[Mapping[str, int]]
    """Cases of each tier in `make proof-full`."""
    place: ClassVar[int] = 100
    """Its column in the table, from the left."""

    rivalled: ClassVar[bool] = False
    """True if the rivals answer some of its cases, too: they take longer than the rest."""

    def why_not(self) -> str | None:
        """The reason why it cannot be made here; None if it can."""
        return None

    @abstractmethod
    def generator(self) -> list[str]:
        """The generator's module and options of its own; it also takes --tier --cases --seed --jobs --out --key."""

    def names(self, told: Json) -> list[str]:
        """The names of the cases that a key (`told`) has."""
        return list(told["cases"])

    def complete(self, protocol: Protocol, tier: str, name: str) -> bool:
        """True if all files of a case have been written."""
        return recording_of(protocol.cases(tier) / name) is not None

    def truths(self, protocol: Protocol, tier: str, told: Json) -> Iterator[Truth]:
        """Yields what a key (`told`) says of each case; here as tests/concealed writes it."""
        del protocol, tier
        for name, entry in told["cases"].items():
            yield truth_of(name, entry)

    def maps(self) -> Mapping[str, Map]:
        """The effects whose parametrisation is the tool's after a change of units, by the catalogue's id."""
        return {}

    def inexact(self) -> Mapping[str, str]:
        """The reasons why others have no such map."""
        return {}


def recording_of(case: Path) -> Path | None:
    """The file of a case that the tool is given: a session or a table; None if there is none."""
    return next((path for name in ("session.mcap", "table.csv") if (path := case / name).exists()), None)


@cache
def families() -> dict[str, Family]:
    """All families by name, in the order of the table."""
    found = list[Family]()
    for info in pkgutil.iter_modules(__path__):
        module = importlib.import_module(f"{__name__}.{info.name}")
        for value in vars(module).values():
            if inspect.isclass(value) and issubclass(value, Family) and not inspect.isabstract(value):
                found += [value()] if value.__module__ == module.__name__ else []
    return {family.name: family for family in sorted(found, key=lambda one: (one.place, one.name))}
