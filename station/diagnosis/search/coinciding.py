"""The covariate on which each law depends alone, and which covariates run together in a design.

No law is known exactly. A smooth function of a covariate fits better than a law of it, and is no other finding; and of
a load that was raised from run to run a law is also one of the run's number, in another form, which tells little.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
from scipy.stats import rankdata

from station.diagnosis import thresholds
from station.diagnosis.observations.evidence import Evidence
from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Values

FIELDS = ("run", "mass_kg", "rest_s", "temperature_c", "relative_humidity")
"""The fields of a contact that a protocol or its course sets for a run."""


@dataclass(frozen=True, kw_only=True)
class Coinciding:
    """The one field on which each effect depends, by its id, and the fields that run together with another one."""

    of: Mapping[str, str] = field(default_factory=dict[str, str])
    together: frozenset[str] = frozenset()

    @classmethod
    def among(cls, evidence: Evidence, effects: Iterable[Effect]) -> Self:
        """Returns the effects that depend on one of the fields that vary."""
        contact = evidence.contact()
        if contact is None:
            return cls()
        depends = {effect.id: _depends(effect, contact) for effect in effects}
        return cls(
            of={name: fields[0] for name, fields in depends.items() if len(fields) == 1},
            together=_together(contact),
        )

    def repeats(self, effect: Effect, known: Iterable[str]) -> bool:
        """Returns true if an effect and one that is known, by its id, depend on fields that run together."""
        return self.of.get(effect.id) in self.together and any(self.of.get(name) in self.together for name in known)


def _together(contact: Contact) -> frozenset[str]:
    """Returns the fields that are in nearly the same order, or the opposite one, as another field.

    What one has beside the other is less than the share by which a law misses nature's (KNOWN_TO).
    """
    ranks = {name: _rank(getattr(contact, name)) for name in FIELDS}
    varying = {name: rank for name, rank in ranks.items() if rank is not None}
    found = set[str]()
    for one, other in itertools.combinations(varying, 2):
        if 1.0 - float(np.mean(varying[one] * varying[other])) ** 2 < 1.0 / thresholds.KNOWN_TO:
            found |= {one, other}
    return frozenset(found)


def _rank(values: Array) -> Array | None:
    """Returns standardised ranks (n,); None if the values do not vary or are not all known."""
    if len(values) < 2 or not np.isfinite(values).all() or not np.ptp(values):
        return None
    rank = rankdata(values)
    return np.asarray((rank - rank.mean()) / rank.std(), dtype=np.float64)


def _depends(effect: Effect, contact: Contact) -> tuple[str, ...]:
    """Returns the varying fields whose order changes what an effect of its typical size does."""
    values = {one.name: one.clipped(one.neutral + (0.0 if one.is_shape else one.typical)) for one in effect.parameters}
    here = _done(effect, contact, values)
    return tuple(
        name
        for name in FIELDS
        if _rank(getattr(contact, name)) is not None
        and not np.allclose(here, _done(effect, _reversed(contact, name), values), rtol=1e-9, atol=1e-12)
    )


def _reversed(contact: Contact, name: str) -> Contact:
    """Returns the contacts with one field's values in the opposite order of their ranks."""
    values = getattr(contact, name)
    order = np.argsort(values, kind="stable")
    turned = np.empty_like(values)
    turned[order] = values[order[::-1]]
    return replace(contact, **{name: turned})


def _done(effect: Effect, contact: Contact, values: Values) -> Array:
    """Returns the factor on friction and the push that an effect makes (n, 4)."""
    push = effect.push(contact, values)
    factor = np.broadcast_to(effect.friction(contact, values), len(contact))
    return np.column_stack([factor, np.zeros((len(contact), 3)) if push is None else push])
