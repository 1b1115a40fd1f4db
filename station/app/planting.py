"""Effects named on the command line: `kinetic_drop=0.3`, `stribeck.speed_m_s=0.05`."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from shared.arguments import nearest
from shared.errors import UserError
from shared.messages import Sample
from station.physics.catalogue import Catalogue
from station.physics.effect import Effect
from station.physics.model import Model, model_of_table, table_of_model


def plant(words: Iterable[str], model: Model, known: Catalogue) -> Model:
    """Returns the model with the effects of `words`, each ID=VALUE or ID.PARAMETER=VALUE, in the parameter's unit.

    ID alone means the effect's first parameter; parameters that are not named keep the model's value, or their null.

    Raises:
        UserError: for another form, an unknown effect or parameter, or a value outside its bounds.
    """
    table = table_of_model(model)
    for word in words:
        effect, parameter, value = _read(word, known)
        table["effects"].setdefault(effect.id, {})[parameter] = value
    return model_of_table(table, known)


def effects_meant(name: str, known: Catalogue) -> str:
    """Returns the end of a sentence on an effect that is none: the nearest ones, or where they are listed."""
    return nearest(name, known, most=3) or "; `station effects` lists them"


def plain_model(samples: Sequence[Sample]) -> Model:
    """Returns one constant friction without scatter: the median of tan(onset) of the runs that slid.

    Raises:
        UserError: if none slid.
    """
    slid = [math.tan(one.onset_angle_rad) for one in samples if not one.censored and one.onset_angle_rad > 0]
    if not slid:
        raise UserError("Expected runs that slid, which tell the friction, found none; give it with --model")
    return Model(mu_s=float(np.median(slid)))


def _read(word: str, known: Catalogue) -> tuple[Effect, str, float]:
    name, _, number = word.partition("=")
    identifier, _, parameter = name.partition(".")
    if not name or not number:
        raise UserError(f"Expected ID=VALUE or ID.PARAMETER=VALUE, such as kinetic_drop=0.3, got '{word}'")
    if identifier not in known:
        raise UserError(f"Expected an effect of the catalogue, got '{identifier}'{effects_meant(identifier, known)}")
    effect = known[identifier]
    try:
        return effect, parameter or effect.parameters[0].name, float(number)
    except ValueError:
        raise UserError(f"Expected a number after {name}=, got '{number}'") from None
