"""The advice that separates effects, in the terms of how the friction was measured."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from station.diagnosis import thresholds
from station.diagnosis.observations.evidence import Evidence
from station.physics.effect import Effect, Family

ELSEWHERE: Mapping[Family, str] = MappingProxyType(
    {
        "speed law": "several sliding speeds, in random order",
        "load": "loads over a range of ten to one, in random order",
        "drift": "all other settings in random order, with a return to one of them every few runs",
        "history": "dwells from 1 to 100 s, in random order",
        "direction law": "several directions of sliding, in random order",
        "place": "several places, in random order",
    }
)
"""The experiment that separates the effects of a family on an apparatus whose plate does not tilt."""


def tilts(evidence: Evidence) -> bool:
    """Returns true if friction was measured by tilting a plate.

    A cube that was thrown and a tribometer know no tilt steps.
    """
    contact = evidence.contact()
    return contact is not None and bool(len(contact)) and float(contact.tilt_rad.max()) > thresholds.LEAST_TILT_RAD


def advice(evidence: Evidence, effect: Effect) -> str:
    """Returns the experiment that shows the effect beside those that look like it; empty if there is none here."""
    return effect.separated_by if tilts(evidence) else ELSEWHERE.get(effect.family, "")
