"""Physics without a name: friction, or a push, that changes smoothly with one of the things it might depend on.

An effect outside the catalogue is modelled by these terms. They are effects like the named ones, fitted to the same
evidence by the same likelihood, so that a name and a smooth term are compared on equal ground: a name wins by needing
fewer numbers, and loses where its law does not fit.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from station.gap.evidence.covariates import ANGLES, covariates_of
from station.gap.evidence.evidence import Evidence
from station.gap.evidence.memory import MEMORY
from station.gap.statistics.places import LEAST_SPREAD, LEAST_SPREAD_RAD
from station.physics.contact import Array, Bools, Contact
from station.physics.effect import Effect, Values
from station.physics.parameter import Parameter

PREFIX = "other:"
"""How the ids of smooth terms begin."""

FARTHEST = 1.5
"""Polynomials count from −1.5 to 1.5 spreads about the middle: they say nothing farther out."""

PLACE_M = 0.03
MOST_POWERS = 3
SWINGS = {"run": (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0)}
"""Covariates that may swing to and fro, and how often over their whole range."""

LEAST_WAVE = 0.1
"""A harmonic that varies less over the angles that occur (of four directions every second sine) would act by its slope
alone: nobody has seen it."""

ONLY_SLIDING = frozenset({"speed"})
ONLY_ONSET = frozenset({"dwell"})
"""A slide renews the contact; and a run that happens to hold longer rests longer, at the onset and sliding alike."""
LEFT_OUT = frozenset({"x", "y", "tilt", "ahead", "yaw", "slide_time", "tilt_rate"})
"""Covariates that are a push's (the place), that stand for others, or that hold the error of what they explain: an
onset that is read late makes its slide seem younger, and its friction less than the onset's; and the tilt's rate is
that of the moment which was read."""

LEAST_CHOSEN = {"dwell": 0.2}
"""Spread from which on a covariate can only be the protocol's choice: a block that holds longer also rests longer, and
by that little friction would seem to depend on the dwell, and not the dwell on friction."""

Waves = Callable[[Contact], Array]


def is_smooth(effect: Effect) -> bool:
    """Whether it is a term without a name."""
    return effect.id.startswith(PREFIX)


def covariate_of(effect: Effect) -> str:
    """What a smooth term depends on; empty for a named effect."""
    return effect.covariate if isinstance(effect, Smooth | SmoothPush) else ""


class Smooth(Effect):
    """ln of the friction is a sum of smooth functions of a covariate; `acts_at` says whether at the onset, sliding."""

    layer = "contact"
    family = "history"
    source = "none: a smooth term"
    separated_by = "nothing: it stands for what has no name"
    covariate: str
    waves: Waves
    acts_at: tuple[bool, bool]

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """See the class."""
        total = self.waves(contact) @ _numbers(values)
        return np.exp(np.where(self._acts(contact.moving), total, 0.0))

    def _acts(self, moving: Bools) -> Bools:
        onset, sliding = self.acts_at
        return (moving & sliding) | (~moving & onset)


class SmoothPush(Effect):
    """A push along the plate that changes with the place: linear in it, with a constant part or without."""

    layer = "contact"
    family = "place"
    source = "none: a smooth term"
    separated_by = "nothing: it stands for what has no name"
    covariate = "position"
    waves: Waves

    def push(self, contact: Contact, values: Values) -> Array | None:
        """See the class."""
        return np.einsum("nik,k->ni", self.waves(contact), _numbers(values))


def _numbers(values: Values) -> Array:
    return np.array([values[f"a{number}"] for number in range(len(values))])


@dataclass(frozen=True)
class _Span:
    """Where a covariate's values lie."""

    middle: float
    spread: float


def smooth_terms(evidence: Evidence) -> tuple[Effect, ...]:
    """All smooth terms that the recording's covariates allow."""
    return tuple(itertools.chain(_frictions(evidence), _pushes(evidence)))


def _frictions(evidence: Evidence) -> Iterator[Effect]:
    values = _values(evidence)
    memory = _memory(evidence)
    for covariate, known in values.items():
        read = memory.get(covariate) or _of_contact(covariate)
        sets = list(_angle_sets(known)) if covariate in ANGLES else list(_power_sets(covariate, known))
        for name, waves in sets:
            for when, acts_at in _whens(evidence, covariate):
                yield _smooth(f"{covariate}, {name}{when}", covariate, _composed(waves[0], read), waves[1], acts_at)


def _whens(evidence: Evidence, covariate: str) -> Iterator[tuple[str, tuple[bool, bool]]]:
    sliding = evidence.channel("along") is not None
    if covariate in ONLY_SLIDING:
        yield " while sliding", (False, True)
        return
    if evidence.channel("onset") is not None:
        yield " at the onset", (True, False)
        if sliding and covariate not in ONLY_ONSET:
            yield "", (True, True)


def _values(evidence: Evidence) -> dict[str, Array]:
    """The values that occur, by covariate, where they vary enough to explain anything."""
    found: dict[str, Array] = {}
    for channel in (evidence.channel("onset"), evidence.channel("along")):
        for name, values in channel.rows.covariates.items() if channel else ():
            if name not in LEFT_OUT and name not in found and _varies(name, values):
                found[name] = values[np.isfinite(values)]
    return found


def _varies(name: str, values: Array) -> bool:
    known = values[np.isfinite(values)]
    if len(known) < max(12, 0.5 * len(values)):
        return False
    if name in ANGLES:
        return 1.0 - abs(np.exp(1j * known).mean()) > 0.5 * LEAST_SPREAD_RAD**2
    return float(np.ptp(np.quantile(known, (0.05, 0.95)))) > LEAST_CHOSEN.get(name, LEAST_SPREAD.get(name, 1e-9))


def _angle_sets(values: Array) -> Iterator[tuple[str, tuple[Callable[[Array], Array], int]]]:
    """Harmonics, as many as the angles that occur can tell apart."""
    distinct = len(np.unique(np.round(np.mod(values, 2 * np.pi) / 0.1)))
    sets = [(1,), (2,), (1, 2), (3,), (4,), (1, 2, 3, 4)] if distinct > 8 else [(1,), (2,), (1, 2)][: distinct - 1]
    for chosen in sets:
        kept = [wave for wave in _waves(chosen) if np.std(wave(values)) > LEAST_WAVE]
        if kept:
            yield f"harmonic {'+'.join(map(str, chosen))}", (_harmonics(kept), len(kept))


def _waves(harmonics: Sequence[int]) -> list[Callable[[Array], Array]]:
    """Cosine and sine of each."""
    return [partial(_wave, function, k) for k in harmonics for function in (np.cos, np.sin)]


def _wave(function: Callable[[Array], Array], k: int, angle: Array) -> Array:
    return function(k * angle)


def _harmonics(chosen: Sequence[Callable[[Array], Array]]) -> Callable[[Array], Array]:
    def waves(angle: Array) -> Array:
        known = np.where(np.isfinite(angle), angle, 0.0)
        return np.where(np.isfinite(angle)[:, None], np.column_stack([wave(known) for wave in chosen]), 0.0)

    return waves


def _power_sets(covariate: str, values: Array) -> Iterator[tuple[str, tuple[Callable[[Array], Array], int]]]:
    low, middle, high = np.quantile(values, (0.05, 0.5, 0.95))
    distinct = len(np.unique(np.round((values - middle) / (high - low), 3)))
    for degree in range(1, min(MOST_POWERS, distinct - 1) + 1):
        yield f"degree {degree}", (_powers(_Span(float(middle), float(high - low)), degree), degree)
    for often in SWINGS.get(covariate, ()):
        yield f"{often:g} swings", (_swings(float(values.min()), float(np.ptp(values)), often), 2)


def _powers(span: _Span, degree: int) -> Callable[[Array], Array]:
    def waves(values: Array) -> Array:
        known = np.where(np.isfinite(values), values, span.middle)
        scaled = np.clip((known - span.middle) / span.spread, -FARTHEST, FARTHEST)
        return np.column_stack([scaled**k for k in range(1, degree + 1)])

    return waves


def _swings(low: float, width: float, often: float) -> Callable[[Array], Array]:
    def waves(values: Array) -> Array:
        phase = 2 * np.pi * often * (np.where(np.isfinite(values), values, low) - low) / width
        return np.column_stack([np.cos(phase), np.sin(phase)])

    return waves


def _composed(waves: Callable[[Array], Array], read: Callable[[Contact], Array]) -> Waves:
    return lambda contact: waves(read(contact))


def _of_contact(covariate: str) -> Callable[[Contact], Array]:
    return lambda contact: covariates_of(contact)[covariate]


def _memory(evidence: Evidence) -> dict[str, Callable[[Contact], Array]]:
    """What only the onset's rows know (the run before), looked up by the run's number."""
    onset = evidence.channel("onset")
    if onset is None:
        return {}
    number = evidence.run_number[onset.rows.run]
    order = np.argsort(number)
    return {
        name: _looked_up(number[order], onset.rows.covariates[name][order])
        for name in MEMORY
        if name in onset.rows.covariates
    }


def _looked_up(number: Array, values: Array) -> Callable[[Contact], Array]:
    def read(contact: Contact) -> Array:
        place = np.minimum(np.searchsorted(number, contact.run), len(number) - 1)
        return np.where(number[place] == contact.run, values[place], np.nan)

    return read


def _pushes(evidence: Evidence) -> Iterator[Effect]:
    onset = evidence.channel("onset") or evidence.channel("along")
    if onset is None or not {"x", "y"} <= onset.rows.covariates.keys():
        return
    if max(float(np.ptp(onset.rows.covariates[axis])) for axis in "xy") < 2e-3:
        return
    for name, waves, size in (("radial push", _radial, 1), ("linear push", _linear, 4), ("push", _affine, 6)):
        made = type("SmoothPush", (SmoothPush,), _attributes(f"position, {name}", "position", size, typical=0.1))()
        made.waves = waves
        yield made


def _radial(contact: Contact) -> Array:
    return np.stack([contact.x_m, contact.y_m, np.zeros(len(contact))], axis=1)[:, :, None] / PLACE_M


def _linear(contact: Contact) -> Array:
    return _fields(contact, (contact.x_m / PLACE_M, contact.y_m / PLACE_M))


def _affine(contact: Contact) -> Array:
    return _fields(contact, (np.ones(len(contact)), contact.x_m / PLACE_M, contact.y_m / PLACE_M))


def _fields(contact: Contact, functions: Sequence[Array]) -> Array:
    """Each function as a push in x and one in y (n, 3, 2 k)."""
    found = np.zeros((len(contact), 3, 2 * len(functions)))
    for place, function in enumerate(functions):
        found[:, 0, 2 * place] = function
        found[:, 1, 2 * place + 1] = function
    return found


def _smooth(name: str, covariate: str, waves: Waves, size: int, acts_at: tuple[bool, bool]) -> Effect:
    made = type("Smooth", (Smooth,), _attributes(name, covariate, size, typical=0.05))()
    made.waves, made.acts_at = waves, acts_at
    return made


def _attributes(name: str, covariate: str, size: int, *, typical: float) -> dict[str, Any]:
    return {
        "id": PREFIX + name,
        "title": f"something outside the catalogue that changes with {covariate}",
        "law": "a sum of smooth functions (all 0)",
        "covariate": covariate,
        "parameters": tuple(
            Parameter(name=f"a{number}", unit="1", low=-1.0, high=1.0, typical=typical) for number in range(size)
        ),
    }
