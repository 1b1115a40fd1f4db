"""Tells in sentences what a model says and an engine cannot: for the file's comment and for the terminal."""

from __future__ import annotations

from collections.abc import Mapping

from station.physics.effect import HOOKS
from station.physics.model import Model

LEFT_OUT = {
    "friction": "its friction by state",
    "push": "its force on the block",
    "spin": "its turning of the block",
    "lever": "its turning of the block by friction",
    "lead": "its pressure in front of the block",
    "attitude": "its turn of the plate",
    "motion": "its motion of the plate, which is turned as reported",
    "delay_s": "its delay of the camera's stamps",
    "creep": "its motion of a block at rest, for which an engine has no force",
    "seen": "its shift of the camera's picture",
    "mass": "its place of the block's mass",
    "shaking": "its random push, drawn anew for each run",
}
"""The part that is missing where the method of that name cannot be said."""


def unsupported_of_model(
    model: Model, *, engine: str, supported: frozenset[str], caveats: Mapping[str, str]
) -> list[str]:
    """Returns a sentence for each effect of which an engine's code leaves something out, or makes something else."""
    said: list[str] = []
    for effect in (term.effect for term in model.terms if not term.effect.is_null(term.values)):
        hooks = [hook for hook in HOOKS if hook in effect.acts_through()]
        missing = [LEFT_OUT[hook] for hook in hooks if hook not in supported]
        if missing:
            said.append(f"{engine} leaves out of {effect.id}: {', '.join(missing)}.")
        said += [f"{effect.id} in {engine}: {caveats[hook]}." for hook in hooks if hook in caveats]
    return said
