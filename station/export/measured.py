"""Tells a measurement of a surface pair in the terms in which simulators speak of friction."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shared.errors import UserError

FixedIn = Literal["object", "plate"]
Array = NDArray[np.float64]
UNKNOWN = (math.nan, math.nan)
SIDE_M = 0.01
MASS_KG = 0.00785
"""The paper's cube (10 mm of steel): the body that is written where a measurement does not say which it was."""


_LEAST, _MOST = 1e-9, 1e9
"""No body in metres or kg and no friction is as small or large, and their products are numbers."""
_TEXTS = ("object", "plate", "fixed_in")


def _refuse_other(name: str, value: object, default: object) -> None:
    """Raises UserError if a field's value, from a file of anybody's, is of another kind."""
    if name in _TEXTS:
        fits, wanted = _is_text(value), "a text"
    elif name == "remarks":
        fits, wanted = isinstance(value, tuple) and all(map(_is_text, _items(value))), "texts"
    elif isinstance(default, tuple):
        fits = isinstance(value, tuple) and len(_items(value)) == 2 and all(map(_is_number, _items(value)))
        wanted = "two numbers"
    else:
        fits, wanted = _is_number(value), "a number"
    if not fits:
        raise UserError(f"Expected {wanted} for {name} of a pair, got {value!r}")


def _items(value: object) -> tuple[Any, ...]:
    return cast(tuple[Any, ...], value)


def _is_text(value: object) -> bool:
    """Returns true for what a file can hold: JSON may have half a letter, which no encoding has."""
    return isinstance(value, str) and not any("\ud800" <= letter <= "\udfff" for letter in value)


def _is_number(value: object) -> bool:
    """Returns true for what a float can hold."""
    return isinstance(value, int | float | np.number) and not (isinstance(value, int) and abs(value) >= 2**63)


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredPair:
    """Static friction of an object on a plate, as the nearest ellipse, and what an ellipse leaves out.

    The limit curve has the half-axes `mu_1` along `axis_rad` (from x of the frame `fixed_in`) and `mu_2` across it; a
    pull in the direction phi moves the object at the tilt arctan(`force(phi)`). The intervals are the measurement's
    (NaN: none). `one_way` is the ratio of friction forwards and backwards along `one_way_rad` (1: none), `other_ratio`
    that of the axes of a second ellipse, fixed in the other body (1: none). `misfit_rad` is by how much of the angle of
    repose the measured curve leaves the ellipse at most. `kinetic_ratio` is mu_k/mu_s (NaN: not measured), `scatter`
    the standard deviation of ln mu from run to run (NaN: not known), `samples` the number of slides. `remarks` are
    sentences of doubt that belong beside the numbers.
    """

    object: str
    plate: str
    mu_1: float
    mu_2: float
    axis_rad: float = 0.0
    fixed_in: FixedIn = "object"
    mu_1_interval: tuple[float, float] = UNKNOWN
    mu_2_interval: tuple[float, float] = UNKNOWN
    one_way: float = 1.0
    one_way_rad: float = 0.0
    other_ratio: float = 1.0
    misfit_rad: float = 0.0
    kinetic_ratio: float = math.nan
    scatter: float = math.nan
    samples: int = 0
    side_m: float = SIDE_M
    mass_kg: float = MASS_KG
    remarks: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuses what is no friction and no body."""
        for spec in fields(self):
            _refuse_other(spec.name, getattr(self, spec.name), spec.default)
        for name in ("mu_1", "mu_2", "one_way", "other_ratio", "side_m", "mass_kg"):
            value = getattr(self, name)
            if not _LEAST <= value <= _MOST:
                raise UserError(f"{self.name}: expected {name} from {_LEAST:g} to {_MOST:g}, got {value}")
        if not (math.isfinite(self.axis_rad) and math.isfinite(self.one_way_rad)):
            raise UserError(f"{self.name}: expected finite angles, got {self.axis_rad} and {self.one_way_rad}")
        if self.mu_1 < self.mu_2:
            raise UserError(f"{self.name}: expected mu_1 to be the higher, got {self.mu_1:g} and {self.mu_2:g}")

    @property
    def name(self) -> str:
        """The name as the paper writes it: 'steel on wood'."""
        return f"{self.object} on {self.plate}"

    @property
    def isotropic(self) -> bool:
        """True if the limit curve is a circle."""
        return self.mu_1 == self.mu_2

    @property
    def mu(self) -> float:
        """Geometric mean of the axes: the one number for what knows no directions."""
        return math.sqrt(self.mu_1 * self.mu_2)

    def force(self, phi_rad: ArrayLike) -> Array:
        """Returns the tangential over the normal force (n,) that the contact holds against pulls towards phi (n,), rad.

        Directions are against x of the frame `fixed_in`.
        """
        along = np.asarray(phi_rad, dtype=np.float64) - self.axis_rad
        return 1.0 / np.hypot(np.cos(along) / self.mu_1, np.sin(along) / self.mu_2)

    def angle_rad(self, phi_rad: ArrayLike) -> Array:
        """Returns tilts (n,), rad, where the object starts to slide.

        Downhill is phi (n,), rad, in the frame `fixed_in`.
        """
        return np.arctan(self.force(phi_rad))
