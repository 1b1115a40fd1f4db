"""What an effect must say of itself before anything is computed with it."""

from __future__ import annotations

from typing import get_args

from station.physics.effect import Effect, Family, Layer
from station.physics.parameter import Parameter

_SENTENCES = ("id", "title", "law", "source", "separated_by")


def missing_in(effect: type[Effect]) -> str | None:
    """What a class lacks to be an effect, in a few words; None if nothing."""
    for name in _SENTENCES:
        value = getattr(effect, name, None)
        if not isinstance(value, str) or not value.strip():
            return f"a text `{name}`"
    if not effect.id.isidentifier():
        return f"an `id` of letters, digits and underscores, not {effect.id!r},"
    for name, allowed in (("layer", get_args(Layer)), ("family", get_args(Family))):
        if getattr(effect, name, None) not in allowed:
            return f"a `{name}` out of {', '.join(allowed)}"
    return _missing_in_parameters(effect) or _missing_in_methods(effect)


def _missing_in_parameters(effect: type[Effect]) -> str | None:
    parameters = getattr(effect, "parameters", None)
    if not isinstance(parameters, tuple) or not all(isinstance(one, Parameter) for one in parameters):
        return "`parameters`, a tuple of Parameter,"
    if all(parameter.is_shape for parameter in parameters):
        return "a parameter with a null value"
    if len({parameter.name for parameter in parameters}) < len(parameters):
        return "parameters with different names"
    return None


def _missing_in_methods(effect: type[Effect]) -> str | None:
    return None if effect().acts_through() else "a method through which it acts (friction, push, …)"
