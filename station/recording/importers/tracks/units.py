"""The columns of a table of tracks, in whatever unit their names say, as SI numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from shared.errors import UserError

LENGTH = MappingProxyType({"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6})
TIME = MappingProxyType({"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9})
ANGLE = MappingProxyType({"rad": 1.0, "mrad": 1e-3, "deg": 0.017453292519943295})
SPEED = MappingProxyType({"m_s": 1.0, "mm_s": 1e-3, "um_s": 1e-6})
FORCE = MappingProxyType({"n": 1.0, "mn": 1e-3, "kn": 1e3})
MASS = MappingProxyType({"kg": 1.0, "g": 1e-3})
AREA = MappingProxyType({"m2": 1.0, "cm2": 1e-4, "mm2": 1e-6})
CELSIUS = MappingProxyType({"c": 1.0})
PIXEL = MappingProxyType({"px": 1.0})
PLAIN = MappingProxyType({"": 1.0})
NAME = MappingProxyType[str, float]({})
"""The units of a column of names: it has none."""

Units = Mapping[str, float]

CORNERS = tuple(f"{axis}{corner}" for corner in range(4) for axis in "xy")
PLATE = ("plate_qw", "plate_qx", "plate_qy", "plate_qz")

QUANTITIES: Mapping[str, Units] = MappingProxyType(
    {
        "run": PLAIN,
        "t": TIME,
        **dict.fromkeys(("x", "y", "z"), LENGTH),
        **dict.fromkeys(("yaw", "roll", "pitch"), ANGLE),
        **dict.fromkeys(CORNERS, PIXEL),
        **dict.fromkeys(("tilt", "azimuth", "plate_mount"), ANGLE),
        **dict.fromkeys(PLATE, PLAIN),
        "sigma": MappingProxyType({**LENGTH, "px": 1.0}),
        "sigma_yaw": ANGLE,
        "mass": MASS,
        "area": AREA,
        "temperature": CELSIUS,
        "relative_humidity": PLAIN,
        "dwell": TIME,
        "displacement": LENGTH,
        "driving_speed": SPEED,
        "normal_load": FORCE,
        "friction_force": FORCE,
        "friction_coefficient": PLAIN,
        "group": NAME,
    }
)
"""Every quantity that is read, with the factors to SI of the units that its column's name may end in."""

ALSO = MappingProxyType({"time": "t", "sliding_speed": "driving_speed"})
"""Other names of quantities, as tables of friction have them."""


@dataclass(frozen=True, slots=True)
class Column:
    """A column of the file: the quantity that it holds, and the factor that makes its numbers SI."""

    name: str
    quantity: str
    factor: float


def columns_of(names: list[str], source: str) -> tuple[dict[str, Column], tuple[str, ...]]:
    """The columns by their quantities, and the names of those that nothing reads.

    Raises:
        UserError: if a quantity comes twice, or only in a unit that is not known.
    """
    found, rest = dict[str, Column](), list[str]()
    for name in names:
        column = _column(name)
        if column is None:
            rest.append(name)
        elif column.quantity in found:
            both = f"'{found[column.quantity].name}' and '{name}'"
            raise UserError(f"Expected {column.quantity} once in {source}, got it in {both}; leave one of them out")
        else:
            found[column.quantity] = column
    _refuse_other_units(rest, found, source)
    return found, tuple(rest)


def _column(name: str) -> Column | None:
    for quantity, units in _known().items():
        own = ALSO.get(quantity, quantity)
        if name == quantity and (not units or "" in units):
            return Column(name, own, 1.0)
        unit = name.removeprefix(f"{quantity}_")
        if unit != name and unit in units:
            return Column(name, own, units[unit])
    return None


def _known() -> dict[str, Units]:
    return {**QUANTITIES, **{name: QUANTITIES[own] for name, own in ALSO.items()}}


def _refuse_other_units(rest: list[str], found: Mapping[str, Column], source: str) -> None:
    for quantity, units in _known().items():
        alike = [name for name in rest if name == quantity or name.startswith(f"{quantity}_")]
        if alike and ALSO.get(quantity, quantity) not in found and any(units):
            named = " or ".join(f"{quantity}_{unit}" for unit in units)
            raise UserError(
                f"Expected {quantity} in a unit that is known in {source}, got the column '{alike[0]}'; "
                f"convert it and call it {named}"
            )
