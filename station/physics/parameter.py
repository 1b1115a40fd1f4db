"""One bounded number of an effect."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """A number that an effect depends on.

    `null` is the value at which the effect vanishes; None marks a shape (a speed scale, a place), which has no meaning
    while the effect vanishes and is therefore started from each of `starts`. `low` and `high` bound the number: a sign
    that physics forbids is outside the bounds. `typical` is a size at which the effect is plain to see: it scales steps
    and starts. A law that has no slope at its null, as it sets in beyond a size, or one whose slope there holds only
    nearby, is also looked at with each of `sizes`. `sd` is the standard deviation of the number's prior about a
    neutral value of 0, where nature says it: the number then costs what the data say beyond it. With 0 it has none.
    `symbol` stands for the number in the effect's law, where that is not its name.
    """

    name: str
    unit: str
    low: float
    high: float
    typical: float
    null: float | None = 0.0
    starts: tuple[float, ...] = ()
    sizes: tuple[float, ...] = ()
    sd: float = 0.0
    symbol: str = ""

    def __post_init__(self) -> None:
        """Refuses, by a ValueError, a parameter that cannot be fitted."""
        if not self.low < self.high:
            raise ValueError(f"parameter {self.name}: expected low < high, got {self.low} and {self.high}")
        if self.null is not None and not self.low <= self.null <= self.high:
            raise ValueError(f"parameter {self.name}: its null value {self.null} is outside {self.low} … {self.high}")
        if self.null is None and not self.starts:
            raise ValueError(f"parameter {self.name}: a shape needs values to start from")
        if self.sd and self.neutral:
            raise ValueError(f"parameter {self.name}: a prior is about 0, but the neutral value is {self.neutral}")
        if not self.typical > 0:
            raise ValueError(f"parameter {self.name}: expected a positive typical size, got {self.typical}")

    @property
    def is_shape(self) -> bool:
        """True if it only shapes an effect whose size is another parameter."""
        return self.null is None

    @property
    def neutral(self) -> float:
        """The null value; for a shape its first start."""
        return self.starts[0] if self.null is None else self.null

    @property
    def in_unit(self) -> str:
        """The unit in brackets, for after the name; a pure number has none."""
        return "" if self.unit == "1" else f" ({self.unit})"

    @property
    def expected(self) -> str:
        """The words for a number within the bounds; a pure number has no unit to tell."""
        return f"a number from {self.low:g} to {self.high:g}{'' if self.unit == '1' else f' {self.unit}'}"

    def clipped(self, value: float) -> float:
        """Returns the nearest value within the bounds."""
        return min(max(value, self.low), self.high)
