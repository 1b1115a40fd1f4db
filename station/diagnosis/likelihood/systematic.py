"""Nuisances: systematic effects of known size that are fitted and never claimed.

An onset is read by fitting a slide back to zero velocity. Creep, a late stamp or a rounded corner of the tilt shift all
onsets of a session alike by some hundredths of a degree. Hundreds of runs would show that difference from the slides'
friction, and it would be called a kinetic coefficient.

An effect that the recording cannot show cannot be excluded either: one that mu absorbs (one mass, no other angle
sensor) leaves a trace of a per cent as the plate returns while the block still slides. Without a nuisance for it that
trace would get another effect's name.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import replace
from typing import ClassVar

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.likelihood.creeping import NEAR_LIMIT
from station.diagnosis.likelihood.leading import PRESSURE_LEAD
from station.diagnosis.likelihood.mapping import CAMERA_MAP
from station.diagnosis.observations.channel import REST
from station.diagnosis.observations.evidence import Evidence
from station.physics.contact import Array, Contact, View
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.model import Model, Term
from station.physics.parameter import Parameter

TILTED = 0.05
"""The sine of the tilt from which on a plate counts as tilted."""

LEAST_SLOPE = 0.05
"""The smallest slope by which a late reading is divided: on a level plate it has no relative size."""


class OnsetReading(Effect):
    """All onsets are read a little early or late."""

    id: ClassVar[str] = "_onset_reading"
    title: ClassVar[str] = "reading of the onsets"
    law: ClassVar[str] = "static friction reads (1 + shift) times what it is, its tilt by blur times θ'' more (both 0)"
    source: ClassVar[str] = "none: a nuisance of the measurement"
    layer: ClassVar[Layer] = "rig"
    family: ClassVar[Family] = "level"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="shift", unit="1", low=-0.1, high=0.1, typical=thresholds.ONSET_SHIFT),
        Parameter(name="blur_s2", unit="s²", low=-5e-3, high=5e-3, typical=thresholds.ONSET_BLUR_S2),
    )
    separated_by: ClassVar[str] = "nothing: it is allowed for"

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """Returns the factor (n,) on friction by which the onsets are read early or late; 1 while the block slides."""
        if contact.moving.all():
            return 1.0
        about_x, about_y, _ = contact.acceleration_rad_s2.T
        bend = contact.down[:, 0] * about_y - contact.down[:, 1] * about_x  # about the tilt's axis
        slope = np.maximum(0.5 * np.sin(2.0 * contact.tilt_rad), LEAST_SLOPE)
        return np.where(contact.moving, 1.0, 1.0 + values["shift"] + values["blur_s2"] * bend / slope)


ONSET_READING = OnsetReading()


class PictureReading(Effect):
    """A mark on a tilted plate is read beside its place, by as little as the tracker's systematic floor.

    It belongs to the reading and not to the camera, whose effects also bend slides: so small a bend is invisible.
    """

    id: ClassVar[str] = "_picture_reading"
    strains: ClassVar[bool] = False
    title: ClassVar[str] = "reading of the block's place"
    law: ClassVar[str] = "the block seems to lie sag sin(tilt), and step once the plate is tilted, down the slope (0)"
    source: ClassVar[str] = "none: a nuisance of the measurement"
    layer: ClassVar[Layer] = "rig"
    family: ClassVar[Family] = "image"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="sag_m", unit="m", low=-2e-5, high=2e-5, typical=thresholds.PLACE_TRUSTED_M),
        Parameter(name="step_m", unit="m", low=-2e-5, high=2e-5, typical=thresholds.PLACE_TRUSTED_M),
    )
    separated_by: ClassVar[str] = "nothing: it is allowed for"

    def seen(self, view: View, values: Values) -> Array | None:
        """Returns the block mark's apparent shift (n, points, 2) down the slope, m; None for other marks."""
        if not view.on_block:
            return None
        sine = np.sin(view.tilt_rad)
        shift = (values["sag_m"] * sine + values["step_m"] * np.minimum(sine / TILTED, 1.0))[:, None] * view.down
        return view.shifted(shift)


PICTURE_READING = PictureReading()


def nuisances(evidence: Evidence, model: Model) -> tuple[Effect, ...]:
    """Returns the nuisances of the measurement, then those that the model allows for.

    Without slides the reading of the onsets is part of mu, and is no nuisance.
    """
    onset = (ONSET_READING,) if evidence.onsets and evidence.slides else ()
    picture = (PICTURE_READING, NEAR_LIMIT) if evidence.channel(REST) else ()
    across = (PRESSURE_LEAD,) if evidence.channel("across") else ()
    mapped = (CAMERA_MAP,) if evidence.channel("across") or evidence.channel("shape") else ()
    reading = (*onset, *picture, *across, *mapped)
    allowed = (term.effect for term in model.terms if is_nuisance(term.effect) and term.effect not in reading)
    return (*reading, *allowed)


def allowing_for(model: Model, effects: Iterable[Effect]) -> Model:
    """Returns the model with these effects added as nuisances, at their nulls."""
    return replace(model, terms=(*model.terms, *(_allowed(effect) for effect in effects)))


def _allowed(effect: Effect) -> Term:
    """Returns the same law under a nuisance's id, with its largest plausible size as its prior's standard deviation."""
    wide = tuple(
        replace(parameter, typical=thresholds.PLAUSIBLE * parameter.typical) for parameter in effect.parameters
    )
    return Term(effect.having(id=f"_{effect.id}", parameters=wide), effect.neutral())


def is_nuisance(effect: Effect) -> bool:
    """Returns true if an effect is fitted and never claimed."""
    return effect.id.startswith("_")


def claimable(model: Model) -> list[Effect]:
    """Returns the model's effects that are no nuisances."""
    return [term.effect for term in model.terms if not is_nuisance(term.effect)]


def keeping(model: Model, ids: Collection[str]) -> Model:
    """Returns the model with its nuisances and only these of its other effects, by their ids."""
    return replace(model, terms=tuple(one for one in model.terms if is_nuisance(one.effect) or one.effect.id in ids))


def less(model: Model, *ids: str) -> Model:
    """Returns the model without some of its effects, by their ids."""
    return keeping(model, {effect.id for effect in claimable(model)} - set(ids))


def without_nuisances(model: Model) -> Model:
    """Returns the model without its nuisances."""
    terms = tuple(term for term in model.terms if not is_nuisance(term.effect))
    return Model(mu_s=model.mu_s, scatter=model.scatter, terms=terms)
