"""The multipliers of friction from run to run: four families of distributions.

Every family has two parameters, the last has three: lognormal (median, sigma of the logarithm), gamma and Weibull
(shape, scale), and log-t (median, sigma, degrees of freedom): the logarithm has Student's distribution, and with it
rare runs far off.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from station.friction.direction import Array

Family = Literal["lognormal", "gamma", "weibull", "log_t"]
FAMILIES: tuple[Family, ...] = ("lognormal", "gamma", "weibull", "log_t")
PARAMETERS: dict[Family, tuple[str, ...]] = {
    "lognormal": ("median", "sigma"),
    "gamma": ("shape", "scale"),
    "weibull": ("shape", "scale"),
    "log_t": ("median", "sigma", "dof"),
}
_SPECIAL = cast(Any, special)  # compiled functions without annotations


@dataclass(frozen=True, slots=True)
class Multiplier:
    """A distribution of positive numbers about 1; `parameters` are in the order of `PARAMETERS`."""

    family: Family
    parameters: tuple[float, ...]

    def __post_init__(self) -> None:
        """Refuses a wrong number of parameters, and those that are not positive."""
        names = PARAMETERS.get(self.family)
        if names is None:
            raise ValueError(f"expected one of {', '.join(FAMILIES)}, got {self.family!r}")
        if len(self.parameters) != len(names) or not min(self.parameters) > 0:
            raise ValueError(f"expected positive {', '.join(names)} for {self.family}, got {self.parameters}")

    def log_density(self, values: ArrayLike) -> Array:
        """Returns the ln of the density (n,) at positive values (n,)."""
        x = np.asarray(values, dtype=np.float64)
        first, second = self.parameters[:2]
        if self.family == "gamma":
            return (first - 1) * np.log(x / second) - x / second - _SPECIAL.gammaln(first) - np.log(second)
        if self.family == "weibull":
            power = first * np.log(x / second)
            return np.log(first) + power - np.log(x) - _power(x / second, first)
        z = np.log(x / first) / second
        if self.family == "lognormal":
            return -0.5 * z**2 - np.log(x * second) - 0.5 * np.log(2 * np.pi)
        nu = self.parameters[2]
        constant = _SPECIAL.gammaln((nu + 1) / 2) - _SPECIAL.gammaln(nu / 2) - 0.5 * np.log(nu * np.pi)
        return constant - (nu + 1) / 2 * np.log1p(z**2 / nu) - np.log(x * second)

    def below(self, values: ArrayLike) -> Array:
        """Returns the probability (n,) of a smaller value."""
        x = np.asarray(values, dtype=np.float64)
        first, second = self.parameters[:2]
        if self.family == "gamma":
            return _SPECIAL.gammainc(first, x / second)
        if self.family == "weibull":
            return -np.expm1(-_power(x / second, first))
        with np.errstate(divide="ignore"):
            z = np.log(x / first) / second
        return _SPECIAL.ndtr(z) if self.family == "lognormal" else _SPECIAL.stdtr(self.parameters[2], z)

    def above(self, values: ArrayLike) -> Array:
        """Returns the probability (n,) of a larger value, with its digits where it is small."""
        x = np.asarray(values, dtype=np.float64)
        first, second = self.parameters[:2]
        if self.family == "gamma":
            return _SPECIAL.gammaincc(first, x / second)
        if self.family == "weibull":
            return np.exp(-_power(x / second, first))
        with np.errstate(divide="ignore"):
            z = -np.log(x / first) / second
        return _SPECIAL.ndtr(z) if self.family == "lognormal" else _SPECIAL.stdtr(self.parameters[2], z)

    def between(self, low: ArrayLike, high: ArrayLike) -> Array:
        """Returns the probability (n,) of a value between two (n,), from whichever end is nearer."""
        return np.maximum(
            np.where(self.below(low) > 0.5, self.above(low) - self.above(high), self.below(high) - self.below(low)), 0.0
        )

    def quantile(self, probability: ArrayLike) -> Array:
        """Returns the value (n,) that is not reached with this probability (n,)."""
        p = np.asarray(probability, dtype=np.float64)
        first, second = self.parameters[:2]
        if self.family == "gamma":
            return second * _SPECIAL.gammaincinv(first, p)
        if self.family == "weibull":
            return second * (-np.log1p(-p)) ** (1 / first)
        z = _SPECIAL.ndtri(p) if self.family == "lognormal" else _SPECIAL.stdtrit(self.parameters[2], p)
        return first * np.exp(second * z)

    def draw(self, rng: np.random.Generator, size: int | tuple[int, ...]) -> Array:
        """Returns independent draws (size,), or of the shape `size`."""
        first, second = self.parameters[:2]
        if self.family == "gamma":
            return rng.gamma(first, second, size)
        if self.family == "weibull":
            return second * rng.weibull(first, size)
        z = rng.standard_normal(size) if self.family == "lognormal" else rng.standard_t(self.parameters[2], size)
        return first * np.exp(second * z)


def _power(values: Array, exponent: float) -> Array:
    """Returns powers (n,) of positive values (n,): infinite, as is their limit, where runs hardly scatter."""
    with np.errstate(over="ignore"):
        return values**exponent
