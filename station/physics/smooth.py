"""Smooth terms: friction, or a push, that changes smoothly with one covariate, for physics that has no name.

An effect outside the catalogue is modelled by these terms. They are effects like the named ones, so simulators take
them; unlike those they hold numbers of the recording that they were found in, such as its covariates' range. They are
therefore in no catalogue, and model.toml has them whole, see `smooth_table`.
"""

from __future__ import annotations

import itertools
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from shared.vectors import columns
from station.physics.contact import Array, Bools, Contact, unit
from station.physics.covariates import READ
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter

PREFIX = "other:"
"""The ids of smooth terms begin with this."""

FARTHEST = 1.5
"""Polynomials are clipped at 1.5 spreads from the middle: they say nothing farther out."""

PLACE_M = 0.03
"""The place on the plate at which a push that is linear in it has its coefficient's size."""

Wave = Literal["cos", "sin"]
When = Literal["onset", "sliding"]
Direction = Literal["radial", "linear", "any", "field"]


class Form(ABC):
    """A few smooth functions of one covariate, whose weighted sum is the log of a factor on friction."""

    @property
    @abstractmethod
    def size(self) -> int:
        """The number of functions."""

    @property
    @abstractmethod
    def words(self) -> str:
        """A few words for reports, which distinguish it from other forms of the same covariate."""

    @abstractmethod
    def of(self, values: Array) -> Array:
        """Returns the functions (n, size) of a covariate's values (n,); 0 where a value is unknown."""


@dataclass(frozen=True, kw_only=True)
class Harmonics(Form):
    """cos and sin of multiples of an angle."""

    waves: tuple[tuple[Wave, int], ...]

    @property
    def size(self) -> int:
        """The number of waves."""
        return len(self.waves)

    @property
    def words(self) -> str:
        """The orders, such as 'harmonic 1+2'."""
        return "harmonic " + "+".join(str(k) for k in sorted({k for _, k in self.waves}))

    def of(self, values: Array) -> Array:
        """Returns the waves (n, size), in their order, of the angles `values` (n,), rad; 0 where one is unknown."""
        known = np.isfinite(values)
        angle = np.where(known, values, 0.0)
        waves = [WAVES[wave](k * angle) for wave, k in self.waves]
        return np.where(known[:, None], columns(*waves), 0.0)


WAVES: dict[Wave, np.ufunc] = {"cos": np.cos, "sin": np.sin}
"""The functions that an angle's waves are made of."""


@dataclass(frozen=True, kw_only=True)
class Powers(Form):
    """Powers 1 … `degree` of (value − `middle`) / `spread`, which is clipped to ± FARTHEST."""

    middle: float
    spread: float
    degree: int

    @property
    def size(self) -> int:
        """The degree."""
        return self.degree

    @property
    def words(self) -> str:
        """The degree, such as 'degree 2'."""
        return f"degree {self.degree}"

    def of(self, values: Array) -> Array:
        """Returns the powers (n, degree), from the first on, of a covariate's `values` (n,), in its unit.

        They are 0 where unknown.
        """
        known = np.where(np.isfinite(values), values, self.middle)
        scaled = np.clip((known - self.middle) / self.spread, -FARTHEST, FARTHEST)
        # Products take a tenth of the time of powers above the second.
        powers = itertools.accumulate(itertools.repeat(scaled, self.degree), np.multiply)
        return columns(*powers)


@dataclass(frozen=True, kw_only=True)
class Swings(Form):
    """Cosine and sine of a phase with `often` periods while the value goes from `low` on by `width`."""

    low: float
    width: float
    often: float

    @property
    def size(self) -> int:
        """Two: cosine and sine."""
        return 2

    @property
    def words(self) -> str:
        """The number of periods, such as '2.5 swings'."""
        return f"{self.often:g} swings"

    def of(self, values: Array) -> Array:
        """Returns cosine and sine (n, 2) for a covariate's `values` (n,) in its own unit; 0 where one is unknown."""
        known = np.isfinite(values)
        phase = 2 * np.pi * self.often * (np.where(known, values, self.low) - self.low) / self.width
        return np.where(known[:, None], columns(np.cos(phase), np.sin(phase)), 0.0)


@dataclass(frozen=True, eq=False)
class ByRun:
    """A covariate that a contact does not have, such as the last run's slide: its values by the runs' numbers."""

    run: Array
    """Run numbers (r,), ascending."""
    value: Array

    def __call__(self, contact: Contact) -> Array:
        """Returns the value (n,) of each moment's run; nan for a run without one."""
        place = np.minimum(np.searchsorted(self.run, contact.run), len(self.run) - 1)
        return np.where(self.run[place] == contact.run, self.value[place], np.nan)

    def __repr__(self) -> str:
        """Returns the expression that makes an equal covariate, with NumPy as np."""
        return f"ByRun(np.array({self.run.tolist()}), np.array({self.value.tolist()}, float))"


class Unnamed(Effect):
    """The base of all smooth terms."""

    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "history"
    law: ClassVar[str] = "a sum of smooth functions (all 0)"
    source: ClassVar[str] = "none: a smooth term"
    separated_by: ClassVar[str] = "nothing: it stands for what has no name"
    is_series: ClassVar[bool] = True
    covariate: str

    def __init__(self, covariate: str, words: str, *, size: int, typical: float, unit: str, most: float) -> None:
        """Has `size` coefficients a0, a1, …, each at most `most` in size."""
        self.covariate = covariate
        # A named effect has these in its class; an unnamed one has its own.
        vars(self).update(
            id=f"{PREFIX}{covariate}, {words}",
            title=f"something outside the catalogue that changes with {covariate}",
            parameters=tuple(
                Parameter(name=f"a{number}", unit=unit, low=-most, high=most, typical=typical) for number in range(size)
            ),
        )


class Smooth(Unnamed):
    """A factor on friction, whose log is a weighted sum of a form's functions, at the onset, sliding, or both."""

    def __init__(self, covariate: str, form: Form, *, at: frozenset[When], by_run: ByRun | None = None) -> None:
        """Depends on `covariate`; `by_run` has the values of a covariate that no contact has."""
        words = form.words + _WHEN[at]
        super().__init__(covariate, words, size=form.size, typical=0.05, unit="1", most=1.0)
        self.form, self.at, self.by_run = form, at, by_run

    def __repr__(self) -> str:
        """Returns the expression that makes an equal term."""
        at = f"frozenset({sorted(self.at)})"
        return f"Smooth({self.covariate!r}, {self.form!r}, at={at}, by_run={self.by_run!r})"

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """Returns the factor (n,) on friction."""
        read = self.by_run or READ[self.covariate]
        total = self.form.of(read(contact)) @ _numbers(values)
        return np.exp(np.where(self._acts(contact.moving), total, 0.0))

    def _acts(self, moving: Bools) -> Bools:
        return (moving & ("sliding" in self.at)) | (~moving & ("onset" in self.at))


_WHEN: dict[frozenset[When], str] = {
    frozenset({"onset"}): " at the onset",
    frozenset({"sliding"}): " while sliding",
    frozenset({"onset", "sliding"}): "",
}


class Push(Unnamed):
    """A push along the plate, m/s²; `direction` tells the pushes by one covariate apart."""

    family: ClassVar[Family] = "place"
    direction: str


class SmoothPush(Push):
    """A push along the plate, m/s², by the place: radial, linear, linear with a constant, or a field.

    A field is the slope of a hill, a polynomial of fourth degree of the place: a plate that is bent, or a magnet.
    """

    def __init__(self, direction: Direction) -> None:
        """Has one coefficient if 'radial', four if 'linear', six if 'any', fourteen if 'field'."""
        self.direction = direction
        size, words = PUSHES[direction]
        super().__init__("position", words, size=size, typical=0.1, unit="m/s²", most=1.0)

    def __repr__(self) -> str:
        """Returns the expression that makes an equal term."""
        return f"SmoothPush({self.direction!r})"

    def push(self, contact: Contact, values: Values) -> Array | None:
        """Returns the push (n, 3), m/s², in P."""
        return np.einsum("nik,k->ni", self._waves(contact), _numbers(values))

    def _waves(self, contact: Contact) -> Array:
        """Returns the pushes (n, 3, k) of all coefficients at 1."""
        x, y = contact.x_m / PLACE_M, contact.y_m / PLACE_M
        if self.direction == "radial":
            return np.stack([x, y, np.zeros(len(contact))], axis=1)[:, :, None]
        if self.direction == "field":
            return _hill_slopes(x, y)
        functions = (x, y) if self.direction == "linear" else (np.ones(len(contact)), x, y)
        found = np.zeros((len(contact), 3, 2 * len(functions)))
        for index, function in enumerate(functions):
            found[:, 0, 2 * index] = found[:, 1, 2 * index + 1] = function
        return found


class PushAside(Push):
    """A push on a sliding block, m/s², the same everywhere and in every direction: to the left of its way (or right).

    It has no mechanism in the catalogue. Cubes that were tossed on a board swerve to the left of their ways by
    0.024 ± 0.002 m/s² on the average, a hundredth of what slows them down, in each of four quarters of the ways.
    Without it a push by the place was told of them, which it resembled where they had slid outward.
    """

    def __init__(self) -> None:
        """Has one coefficient."""
        self.direction = "aside"
        super().__init__("way", "push aside", size=1, typical=0.1, unit="m/s²", most=1.0)

    def __repr__(self) -> str:
        """Returns the expression that makes an equal term."""
        return "PushAside()"

    def push(self, contact: Contact, values: Values) -> Array | None:
        """Returns the push (n, 3), m/s², in P."""
        left = unit(contact.way_rad + np.pi / 2) * (values["a0"] * contact.moving)[:, None]
        return np.column_stack([left, np.zeros(len(contact))])


def _hill_slopes(x: Array, y: Array) -> Array:
    """Returns the slopes (n, 3, k) of the hills at places (n,)."""
    found = np.zeros((len(x), 3, len(HILLS)))
    of_x, of_y = (np.vander(one, HIGHEST + 1, increasing=True).T for one in (x, y))
    for k, (i, j) in enumerate(HILLS):
        if i > 0:
            found[:, 0, k] = i * of_x[i - 1] * of_y[j]
        if j > 0:
            found[:, 1, k] = j * of_x[i] * of_y[j - 1]
    return found


HIGHEST = 4
HILLS = tuple((degree - j, j) for degree in range(1, HIGHEST + 1) for j in range(degree + 1))
"""The powers of x and y in a field's hill."""

PUSHES: dict[Direction, tuple[int, str]] = {
    "radial": (1, "radial push"),
    "linear": (4, "linear push"),
    "any": (6, "push"),
    "field": (len(HILLS), "field"),
}
"""The number of coefficients of each kind of push by the place, and its name in reports."""


def pushes() -> tuple[Push, ...]:
    """Returns every kind of push."""
    return (*(SmoothPush(direction) for direction in PUSHES), PushAside())


def is_smooth(effect: Effect) -> bool:
    """Returns true for a term without a name."""
    return isinstance(effect, Unnamed)


def is_of_the_air(effect: Effect) -> bool:
    """Returns true for a straight line in temperature or humidity that acts on onset and slide alike."""
    return isinstance(effect, Smooth) and effect.covariate in AIR and effect.form.size == 1 and len(effect.at) > 1


AIR = frozenset({"temperature", "humidity"})


def _numbers(values: Values) -> Array:
    return np.array([values[f"a{number}"] for number in range(len(values))])
