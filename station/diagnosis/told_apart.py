"""The numbers of an effect by which recording and simulation are told apart, of those that are compared."""

from __future__ import annotations

from collections.abc import Sequence

from station.diagnosis.inference.determined import determined
from station.diagnosis.inference.fit import Fit
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.result import Differs
from station.diagnosis.search.unnamed import change
from station.physics.model import Term


def told_apart(numbers: Sequence[Differs], together: Sequence[Differs], *, price: float) -> tuple[Differs, ...]:
    """Returns the numbers each of which alone differs: it gains more than the price of a number.

    If none does, the clearest is given of them all and of what they determine `together`.
    """
    apart = tuple(one for one in numbers if _gain(one) > price)
    return apart or (max([*together, *numbers], key=_gain),)


def determined_together(evidence: Evidence, fits: Sequence[Fit], terms: Sequence[Term]) -> tuple[Differs, ...]:
    """Returns what numbers that trade off in both determine together, at the recorded states."""
    here, there = (
        {one.expression: one.known for one in determined(evidence, fitted, term)}
        for fitted, term in zip(fits, terms, strict=True)
    )
    return tuple(Differs(name=name, recording=here[name], simulation=there[name]) for name in here if name in there)


def change_of_smooth(evidence: Evidence, fits: Sequence[Fit], terms: Sequence[Term]) -> tuple[Differs, ...]:
    """Returns the change that a smooth term makes in recording and simulation; empty for a named effect.

    Its coefficients say little.
    """
    changes = [change(evidence, fitted, term, like=terms[0]) for fitted, term in zip(fits, terms, strict=True)]
    mine, theirs = (None if one is None else one.known for one in changes)
    if changes[0] is None or mine is None or theirs is None:
        return ()
    return (Differs(name=changes[0].expression, recording=mine, simulation=theirs),)


def _gain(one: Differs) -> float:
    """Returns twice the log likelihood that is gained if one number may differ.

    It is 0 of a number at its bound: no more is known of it than that it lies there.
    """
    if one.recording.at_bound or one.simulation.at_bound:
        return 0.0
    variance = one.recording.sd**2 + one.simulation.sd**2
    return (one.recording.value - one.simulation.value) ** 2 / variance if variance > 0 else 0.0
