"""The columns of a table of tracks, in whatever unit their names say, as SI numbers."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from shared.errors import UserError
from station.recording.measured import ONE_OF

LENGTH = MappingProxyType({"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6})
TIME = MappingProxyType({"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9})
ANGLE = MappingProxyType({"rad": 1.0, "mrad": 1e-3, "deg": 0.017453292519943295})
MASS = MappingProxyType({"kg": 1.0, "g": 1e-3})
AREA = MappingProxyType({"m2": 1.0, "cm2": 1e-4, "mm2": 1e-6})
CELSIUS = MappingProxyType({"c": 1.0})
PLAIN = MappingProxyType({"": 1.0})
PIXEL = MappingProxyType({"": 1.0, "px": 1.0})
NAME = MappingProxyType[str, float]({})
"""The units of a column of names: it has none."""

Units = Mapping[str, float]

CORNERS = ("u0", "v0", "u1", "v1", "u2", "v2", "u3", "v3")
PLATE = ("plate_qw", "plate_qx", "plate_qy", "plate_qz")

QUANTITIES: Mapping[str, Units] = MappingProxyType(
    {
        "run": PLAIN,
        "t": TIME,
        **dict.fromkeys(("x", "y", "z"), LENGTH),
        **dict.fromkeys(("yaw", "roll", "pitch"), ANGLE),
        **dict.fromkeys(("tilt", "azimuth", "plate_mount"), ANGLE),
        **dict.fromkeys(PLATE, PLAIN),
        **dict.fromkeys(CORNERS, PIXEL),
        "sigma": LENGTH,
        "sigma_yaw": ANGLE,
        "mass": MASS,
        "area": AREA,
        "temperature": CELSIUS,
        "relative_humidity": PLAIN,
        "dwell": TIME,
        "group": NAME,
    }
)
"""Every quantity that is read, with the factors to SI of the units that its column's name may end in."""


ALSO_CALLED = MappingProxyType({"time": "t", "timestamp": "t", "trial": "run", "angle": "tilt", "heading": "yaw"})
"""Other words for a quantity, by which a column's name may begin."""
NEAR = 0.75
"""A name that is less alike is no slip of the pen: `displacement_m` and `plate_mount_mrad` are 0.6 alike."""


@dataclass(frozen=True, slots=True)
class Column:
    """A column of the file: the quantity that it holds, and the factor that makes its numbers SI."""

    name: str
    quantity: str
    factor: float


def columns_of(names: Sequence[str], source: str) -> tuple[dict[str, Column], tuple[str, ...]]:
    """Returns the columns by their quantities, and those that nothing reads, with the names that they should have.

    Raises:
        UserError: for a quantity that comes twice, or one that is needed under a name that nothing reads.
    """
    found, unknown = dict[str, Column](), list[str]()
    for name in names:
        column = _column(name)
        if column is None:
            unknown.append(name)
            continue
        if column.quantity in found:
            both = f"'{found[column.quantity].name}' and '{name}'"
            raise UserError(f"Expected {column.quantity} once in {source}, got it in {both}; leave one of them out")
        found[column.quantity] = column
    needed, proposed = _needed(found), {name: _proposal(name) for name in unknown}
    wrong = [f"'{name}': {words}" for name, (quantity, words) in proposed.items() if quantity in needed]
    if wrong:
        raise UserError(f"Expected columns of a track in {source}, got {'; '.join(wrong)}")
    friction = [name for name in unknown if name in ONE_OF]
    if needed and friction:
        raise UserError(
            f"Expected columns of a track in {source}, got a table of friction ('{friction[0]}'): "
            "station diagnose takes it as it is"
        )
    return found, tuple(
        f"{name} ({words})" if words and quantity not in found else name for name, (quantity, words) in proposed.items()
    )


def _needed(found: Collection[str]) -> set[str]:
    """Returns the quantities that a table lacks without which it has no track, or not of a plate; of two ways, both."""
    lacks = {"run", "t"} - set(found)
    for one, other in ((("x", "y", "yaw"), CORNERS), (("tilt", "azimuth"), PLATE)):
        if not (set(one) <= set(found) or set(other) <= set(found)):
            lacks |= {*one, *other} - set(found)
    return lacks


def _column(name: str) -> Column | None:
    for quantity, units in QUANTITIES.items():
        if name == quantity and (not units or "" in units):
            return Column(name, quantity, 1.0)
        unit = name.removeprefix(f"{quantity}_")
        if unit != name and unit in units:
            return Column(name, quantity, units[unit])
    return None


def _proposal(name: str) -> tuple[str, str]:
    """Returns the quantity that a name nearly says, and what to do; of an unknown unit, the names in all its units."""
    for quantity, units in QUANTITIES.items():
        if any(units) and (name == quantity or name.startswith(f"{quantity}_")):
            return quantity, f"convert it and call it {' or '.join(f'{quantity}_{unit}' for unit in units)}"
    if quantity := ALSO_CALLED.get(name.lower().partition("_")[0]):
        return quantity, f"rename it {' or '.join(names_of(quantity))}"
    known = {one: quantity for quantity in QUANTITIES for one in names_of(quantity)}
    near = difflib.get_close_matches(name.lower(), known, n=1, cutoff=NEAR)
    return (known[near[0]], f"rename it {near[0]}") if near else ("", "")


def names_of(quantity: str) -> tuple[str, ...]:
    """Returns the names of a quantity's column, the one in SI units first."""
    return tuple(f"{quantity}_{unit}" if unit else quantity for unit in QUANTITIES[quantity] or ("",))
