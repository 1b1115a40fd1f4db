"""The smooth terms, which have no name: one for each covariate that varies enough to explain anything.

They are effects like the named ones (`station.physics.smooth`), fitted to the same evidence by the same likelihood, so
that a name and a smooth term are compared on equal ground: a name wins by needing fewer numbers, and loses where its
law does not fit.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.observations.channel import ACROSS
from station.diagnosis.observations.covariates import ANGLES
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.memory import MEMORY
from station.diagnosis.observations.series import SETTLED
from station.diagnosis.search.places import least_spread
from station.physics.contact import Array
from station.physics.effect import Effect
from station.physics.smooth import (
    PUSHES,
    WAVES,
    ByRun,
    Form,
    Harmonics,
    Powers,
    PushAside,
    Smooth,
    SmoothPush,
    Swings,
    Unnamed,
    Wave,
    When,
)

MOST_POWERS = 3
SWINGS = {"run": (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0)}
"""Covariates that may oscillate, and the numbers of periods over their whole range."""

ONLY_SLIDING = frozenset({"speed", SETTLED})
ONLY_ONSET = frozenset({"dwell"})
"""A slide renews the contact, so a dwell acts at the onset alone. A run that happens to hold longer also rests longer,
which would show at the onset and sliding alike."""
LEFT_OUT = frozenset({"x", "y", "tilt", "ahead", "yaw", "slide_time", "tilt_rate"})
"""These covariates are a push's (the place), stand for others, or hold the error of what they explain: an onset that is
read late makes its slide seem younger and its friction smaller than the onset's, and the tilt's rate is that of the
moment which was read."""

SAME = 1e-6
"""Angles are equal if they differ by less, rad, up to whole turns: that is rounding."""


def covariate_of(effect: Effect) -> str:
    """Returns the covariate of a smooth term; empty for a named effect."""
    return effect.covariate if isinstance(effect, Unnamed) else ""


def smooth_terms(evidence: Evidence) -> tuple[Effect, ...]:
    """Returns all smooth terms that the recording's covariates allow."""
    return tuple(itertools.chain(_frictions(evidence), _pushes(evidence)))


def _frictions(evidence: Evidence) -> Iterator[Effect]:
    values = _values(evidence)
    memory = _memory(evidence)
    for covariate, known in values.items():
        forms = _angle_forms(known) if covariate in ANGLES else _power_forms(covariate, known)
        for form in forms:
            for at in _whens(evidence, covariate):
                yield Smooth(covariate, form, at=at, by_run=memory.get(covariate))


def _whens(evidence: Evidence, covariate: str) -> Iterator[frozenset[When]]:
    """Yields the moments at which a term may act; what was seen at one kind of them only is taken to act at both."""
    if covariate in ONLY_SLIDING:
        yield frozenset({"sliding"})
        return
    if evidence.onsets is not None and (evidence.slides is not None or covariate in ONLY_ONSET):
        yield frozenset({"onset"})
    if covariate not in ONLY_ONSET:
        yield frozenset({"onset", "sliding"})


def _values(evidence: Evidence) -> dict[str, Array]:
    """Returns the values that occur, by covariate, for covariates that vary enough to explain anything."""
    found: dict[str, Array] = {}
    for channel in (evidence.onsets, evidence.slides):
        for name, values in channel.rows.covariates.items() if channel else ():
            if name not in LEFT_OUT and name not in found and _varies(name, values):
                found[name] = values[np.isfinite(values)]
    return {name: values for name, values in found.items() if not _is_another(name, values, found)}


def _is_another(name: str, values: Array, found: Mapping[str, Array]) -> bool:
    """Returns true if an angle repeats one before it, as the texture's does on a plate never turned in its mount.

    The same term under two names would count twice.
    """
    before = itertools.takewhile(lambda other: other != name, found)
    return name in ANGLES and any(
        len(found[other]) == len(values) and float(np.abs(np.exp(1j * found[other]) - np.exp(1j * values)).max()) < SAME
        for other in before
        if other in ANGLES
    )


def _varies(name: str, values: Array) -> bool:
    known = values[np.isfinite(values)]
    if len(known) < max(thresholds.LEAST_ROWS, thresholds.LEAST_KNOWN_SHARE * len(values)):
        return False
    if name in ANGLES:
        return 1.0 - abs(np.exp(1j * known).mean()) > 0.5 * thresholds.LEAST_SPREAD_RAD**2
    spread = float(np.ptp(np.quantile(known, (0.05, 0.95))))
    return spread > least_spread(name)


def _angle_forms(values: Array) -> Iterator[Form]:
    """Yields harmonics of as many orders as the angles that occur can tell apart."""
    distinct = len(np.unique(np.round(np.mod(values, 2 * np.pi) / 0.1)))
    sets = [(1,), (2,), (1, 2), (3,), (4,), (1, 2, 3, 4)] if distinct > 8 else [(1,), (2,), (1, 2)][: distinct - 1]
    for chosen in sets:
        kept: tuple[tuple[Wave, int], ...] = tuple(
            (wave, k) for k in chosen for wave in WAVES if np.std(WAVES[wave](k * values)) > thresholds.LEAST_WAVE
        )
        if {k for _, k in kept} == set(chosen):  # otherwise it would be a smaller set once more
            yield Harmonics(waves=kept)


def _power_forms(covariate: str, values: Array) -> Iterator[Form]:
    low, middle, high = np.quantile(values, (0.05, 0.5, 0.95)).tolist()
    distinct = len(np.unique(np.round((values - middle) / (high - low), 3)))
    for degree in range(1, min(MOST_POWERS, distinct - 1) + 1):
        yield Powers(middle=middle, spread=high - low, degree=degree)
    for often in SWINGS.get(covariate, ()):
        yield Swings(low=float(values.min()), width=float(np.ptp(values)), often=often)


def _memory(evidence: Evidence) -> dict[str, ByRun]:
    """Returns the covariates that a run's rows have and no contact (the run before), as tables by the run's number."""
    channel = evidence.friction
    if channel is None:
        return {}
    number = evidence.facts.number[channel.rows.run]
    order = np.argsort(number)
    known = channel.rows.covariates
    return {name: ByRun(number[order], known[name][order]) for name in (*MEMORY, SETTLED) if name in known}


def _pushes(evidence: Evidence) -> Iterator[Effect]:
    if evidence.channel(ACROSS) is not None:
        yield PushAside()
    onset = evidence.friction
    if onset is None or not {"x", "y"} <= onset.rows.covariates.keys():
        return
    if max(float(np.ptp(onset.rows.covariates[axis])) for axis in "xy") >= thresholds.LEAST_PLACES_M:
        yield from (SmoothPush(direction) for direction in PUSHES)
