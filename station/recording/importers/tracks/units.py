"""The columns of a table of tracks, in whatever unit their names say, as SI numbers."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import NoReturn

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


def columns_of(names: Sequence[str], source: str) -> dict[str, Column]:
    """Returns the columns by their quantities.

    Raises:
        UserError: for columns that nothing reads, or a quantity that comes twice.
    """
    found, read = dict[str, Column](), {name: _column(name) for name in names}
    if unknown := [name for name, column in read.items() if column is None]:
        _refuse(unknown, source)
    for name, column in read.items():
        assert column is not None
        if column.quantity in found:
            both = f"'{found[column.quantity].name}' and '{name}'"
            raise UserError(f"Expected {column.quantity} once in {source}, got it in {both}; leave one of them out")
        found[column.quantity] = column
    return found


def _refuse(unknown: Sequence[str], source: str) -> NoReturn:
    if friction := [name for name in unknown if name in ONE_OF]:
        raise UserError(
            f"Expected columns of a track in {source}, got a table of friction ('{friction[0]}'): "
            "station diagnose takes it as it is"
        )
    proposals = "; ".join(f"'{name}': {_proposal(name)}" for name in unknown)
    raise UserError(f"Expected columns of a track in {source}, got {proposals}")


def _column(name: str) -> Column | None:
    for quantity, units in QUANTITIES.items():
        if name == quantity and (not units or "" in units):
            return Column(name, quantity, 1.0)
        unit = name.removeprefix(f"{quantity}_")
        if unit != name and unit in units:
            return Column(name, quantity, units[unit])
    return None


def _proposal(name: str) -> str:
    """Returns the nearest name that is read; of a known quantity in an unknown unit, those of all its units."""
    for quantity, units in QUANTITIES.items():
        if any(units) and (name == quantity or name.startswith(f"{quantity}_")):
            return f"convert it and call it {' or '.join(f'{quantity}_{unit}' for unit in units)}"
    if quantity := ALSO_CALLED.get(name.lower().partition("_")[0]):
        return f"rename it {' or '.join(names_of(quantity))}"
    known = [one for quantity in QUANTITIES for one in names_of(quantity)]
    near = difflib.get_close_matches(name.lower(), known, n=1, cutoff=NEAR)
    return f"rename it {near[0]}, or leave it out" if near else "leave it out"


def names_of(quantity: str) -> tuple[str, ...]:
    """Returns the names of a quantity's column, the one in SI units first."""
    return tuple(f"{quantity}_{unit}" if unit else quantity for unit in QUANTITIES[quantity] or ("",))
