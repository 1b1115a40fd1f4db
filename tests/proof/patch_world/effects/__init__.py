"""All effects of the patch world, by their ids."""

from __future__ import annotations

from tests.proof.patch_world.effects.base import Effect
from tests.proof.patch_world.effects.foreign import FOREIGN
from tests.proof.patch_world.effects.laws import LAWS
from tests.proof.patch_world.effects.rigs import RIGS
from tests.proof.patch_world.effects.surfaces import SURFACES

EFFECTS: dict[str, Effect] = {effect.id: effect for effect in (*LAWS, *SURFACES, *RIGS, *FOREIGN)}
KNOWN = tuple(effect.id for effect in (*LAWS, *SURFACES, *RIGS))
"""The effects that correspond to one of the tool's catalogue."""
OUTSIDE = tuple(effect.id for effect in FOREIGN)
"""The effects that correspond to none of the tool's catalogue."""
