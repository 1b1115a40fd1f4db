"""The interface of an effect: everything that it may change, none of which it changes unless a subclass says so.

The block on a plate with attitude R (world_from_plate) slides in the direction φ (`way_rad`) against

    F / N = ∇h,   h(φ) = mu_s · Π m_k(φ, state),    N/m = g cos θ + Σ pushes,

h being the support function of the limit curve and m_k each effect's `friction`: the principle of maximum dissipation
then gives onset, first direction and sideways force of any convex curve (Goyal, Ruina, Papadopoulos 1991). The onset is
where max over φ of (T·e(φ) − h(φ) N) passes zero, T being the tangential load.

Not all friction that depends on the direction obeys that principle: an effect says by `steering` how far it does.
"""

from __future__ import annotations

import functools
from abc import ABC
from collections.abc import Mapping
from typing import ClassVar, Literal, Self

from station.physics.contact import Array, Contact, View
from station.physics.parameter import Parameter

Values = Mapping[str, float]
"""The values of an effect's parameters by name, in the parameters' units."""

Layer = Literal["contact", "rig", "camera", "numerics"]
Family = Literal[
    "speed law", "direction law", "timing", "level", "place", "load", "history", "drift", "image", "numerics"
]


class Effect(ABC):
    """One mechanism. A subclass overrides the methods through which it acts, and no others.

    Attributes:
        id: the fixed identifier.
        title: a few words for reports.
        law: the equation in one line, with its null value.
        source: where the law is from.
        layer: contact, rig, camera or numerics.
        family: what it looks like in the data: effects of one family are the first to be confounded.
        parameters: its numbers; at least one has a null value.
        confounded_with: ids of the effects that the standard protocol cannot tell from it.
        separated_by: the experiment that does, in one sentence.
    """

    id: ClassVar[str]
    title: ClassVar[str]
    law: ClassVar[str]
    source: ClassVar[str]
    layer: ClassVar[Layer]
    family: ClassVar[Family]
    parameters: ClassVar[tuple[Parameter, ...]]
    confounded_with: ClassVar[tuple[str, ...]] = ()
    separated_by: ClassVar[str]
    absorbed_by_mu: ClassVar[bool] = False
    """True if no data can tell the effect from another mu while everything that it depends on is constant."""
    demonstrated: ClassVar[Values] = {}
    """Sizes that 60 runs of the standard protocol show (`station demo --effect ID=VALUE`), where they show any."""
    strains: ClassVar[bool] = True
    """False if `seen` moves a mark as a whole, and its shape stays."""
    is_series: ClassVar[bool] = False
    """True if its numbers are terms of a series: people are told what these are together (`derived`)."""

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """Returns the factor m (n,) on the limit curve's support function at `way_rad`; 1 at the null. At least 0."""
        del contact, values
        return 1.0

    def steering(self, contact: Contact, values: Values) -> Array | float:
        """Returns the factor s (n,) on the curve that steers.

        The force across the way is h N (ln s)′, and −h N that against it.

        It is m by the principle of maximum dissipation, and 1 where friction always opposes the motion.
        """
        return self.friction(contact, values)

    def unturned(self, contact: Contact, values: Values) -> Array | float:
        """Returns the factor (n,) on the friction of a block at rest that the moment of `lever` acts on beside it.

        It is m without what the moment takes of it, which a simulator that turns blocks finds by itself.
        """
        return self.friction(contact, values)

    def push(self, contact: Contact, values: Values) -> Array | None:
        """Gives the force per mass on the block beyond gravity and friction (n, 3), m/s², in P; positive z lifts it."""
        del contact, values
        return None

    def spin(self, contact: Contact, values: Values) -> Array | float:
        """Gives the angular acceleration (n,), rad/s², of a sliding block about P's normal, other than by friction."""
        del contact, values
        return 0.0

    def lever(self, contact: Contact, values: Values) -> Array | float:
        """Returns the arm (n,), m, with which the friction f of the sliding block turns it.

        It is the lever in k² ω′ = f · lever, with k² = area / 6.
        """
        del contact, values
        return 0.0

    def lead(self, contact: Contact, values: Values) -> Array | float:
        """Returns the lead (n,) of the pressure on a sliding block over its mass, in widths of the sole; see `sole`."""
        del contact, values
        return 0.0

    def attitude(self, contact: Contact, values: Values) -> Array | None:
        """Gives the rotation vector (n, 3), rad in P that turns the plate from where it is reported to where it is."""
        del contact, values
        return None

    def motion(self, contact: Contact, values: Values) -> Array | None:
        """Gives the plate's own rate, rad/s, and acceleration, rad/s², less the reported ones (n, 2, 3), in P."""
        del contact, values
        return None

    def delay_s(self, values: Values) -> float:
        """Returns the delay of the camera's stamps, s: how much later than the truth they read."""
        del values
        return 0.0

    def arm_delay_s(self, values: Values) -> float:
        """Returns the part of that delay, s, by which the arm's stamps are early: other sensors have it as well."""
        del values
        return 0.0

    def arm_m(self, values: Values) -> Array | None:
        """Returns the arm (3,), m in P, from the plate's true pivot to the configured one: `push` has what it does."""
        del values
        return None

    def creep(self, contact: Contact, values: Values) -> Array | None:
        """Returns the velocity (n, 2), m/s, in P, of the irreversible motion of a block below its onset."""
        del contact, values
        return None

    def seen(self, view: View, values: Values) -> Array | None:
        """Returns the displacement (n, 4, 2), m, in P, of the corners' images from the truth."""
        del view, values
        return None

    def exposed_s(self, view: View, values: Values) -> Array | None:
        """Returns by how much later (n, 4), s, corners are exposed that the picture shows where the view has them.

        An effect with it needs no other place in the picture: `Model.seen` takes it together with all that displaces.
        """
        del view, values
        return None

    def mass(self, contact: Contact, values: Values) -> Array | None:
        """Returns the place (n, 3) of the centre of mass from the sole's middle, in the block's frame, in sole widths.

        The plain block is flat: its mass lies in the sole.
        """
        del contact, values
        return None

    def shaking(self, contact: Contact, values: Values) -> Array | float:
        """Gives the standard deviation (n,), m/s², of a random push along the slope at the onset, drawn once a run."""
        del contact, values
        return 0.0

    def derived(self, contact: Contact, values: Values) -> Mapping[str, tuple[float, str]]:
        """Returns quantities that these states determine where single numbers trade off.

        They map a description to value and unit.
        """
        del contact, values
        return {}

    def __eq__(self, other: object) -> bool:
        """Effects are equal if their ids are: they hold no state, also after being sent to another process."""
        return isinstance(other, Effect) and other.id == self.id

    def __hash__(self) -> int:
        """Returns the hash of the id."""
        return hash(self.id)

    def __repr__(self) -> str:
        """Returns the expression that makes an equal effect."""
        return f"{type(self).__name__}()"

    def having(self, *, parameters: tuple[Parameter, ...], id: str = "") -> Self:
        """Returns the same law with other parameters, and under another `id` if one is given.

        It stays one of its own class: another process, which knows no class that was made here, can be sent it.
        """
        other = object.__new__(type(self))
        vars(other).update(vars(self), parameters=parameters, id=id or self.id)
        return other

    # --- about the effect -----------------------------------------------------------------------------------------

    def neutral(self) -> dict[str, float]:
        """Returns the values at which the effect vanishes."""
        return {parameter.name: parameter.neutral for parameter in self.parameters}

    def is_null(self, values: Values) -> bool:
        """Returns true if the effect vanishes exactly at these values."""
        return all(values[parameter.name] == parameter.null for parameter in self.parameters if not parameter.is_shape)

    def acts_through(self) -> frozenset[str]:
        """Returns the names of the methods that it overrides."""
        return _overridden(type(self))

    def idle(self, contact: Contact) -> frozenset[str]:
        """Gives the shapes that runs with these onsets cannot determine at any size; they stay at their first start."""
        del contact
        return frozenset()

    def why_untestable(self, contact: Contact) -> str | None:
        """Returns the reason, in one sentence, why the runs with these onsets cannot show the effect.

        It is None if there is none.

        It is for what every analysis must know beforehand (no second mass, no other angle sensor). What the design's
        numbers imply the diagnosis finds by itself.
        """
        del contact
        return None


HOOKS = (
    "friction", "push", "spin", "lever", "lead", "attitude", "motion", "delay_s", "creep", "seen", "shaking", "mass",
)  # fmt: skip


@functools.cache
def _overridden(kind: type[Effect]) -> frozenset[str]:
    return frozenset(name for name in HOOKS if getattr(kind, name) is not getattr(Effect, name))
