"""Checks that an effect is described completely before anything is computed with it."""

from __future__ import annotations

from typing import get_args

from station.physics.effect import HOOKS, Effect, Family, Layer
from station.physics.parameter import Parameter

_TEXTS = ("id", "title", "law", "source", "separated_by")
_CHOICES = (("layer", get_args(Layer)), ("family", get_args(Family)))


def fault_of(effect: type[Effect]) -> str | None:
    """Returns the fault of an incomplete effect, as what was expected and what came; None if the class is complete."""
    for name in _TEXTS:
        value = getattr(effect, name, None)
        if not isinstance(value, str) or not value.strip():
            return f"a text for `{name}`, got {value!r}"
    if not effect.id.isidentifier():
        return f"an `id` of letters, digits and underscores, got {effect.id!r}"
    for name, allowed in _CHOICES:
        value = getattr(effect, name, None)
        if value not in allowed:
            return f"one of {', '.join(allowed)} for `{name}`, got {value!r}"
    return _fault_of_parameters(effect) or _fault_of_methods(effect)


def _fault_of_parameters(effect: type[Effect]) -> str | None:
    parameters = getattr(effect, "parameters", None)
    if not isinstance(parameters, tuple) or not all(isinstance(one, Parameter) for one in parameters):
        return f"a tuple of Parameter for `parameters`, got {parameters!r}"
    names = [parameter.name for parameter in parameters]
    if all(parameter.is_shape for parameter in parameters):
        return f"a parameter with a null value, got {', '.join(names) or 'no parameter'}"
    if len(set(names)) < len(names):
        return f"parameters of different names, got {', '.join(names)}"
    return None


def _fault_of_methods(effect: type[Effect]) -> str | None:
    return None if effect().acts_through() else f"one of the methods {', '.join(HOOKS)}, got none of them"
