"""The TOML of an arm's model, as a person would write it: one array a line, and what was estimated in comments."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import tomli_w

from station.rig.arm_model import ArmModel, Capsule, Joint, Vector

_WIDTH = 118
_DECIMALS = 9
_IN_LINE = 4


def toml_of(model: ArmModel, *, notes: Mapping[str, Sequence[str]], about: Sequence[str]) -> str:
    """Gives the text of a model's file: `load_arm_model` reads it back. `notes` belong to "base" and to joints by name.

    Args:
        model: the arm.
        notes: what was estimated, a sentence each; ends as comments above its table.
        about: sentences for the file's head.
    """
    return "\n".join([*_comments(about), *_head(model), *_tables(model, notes)]) + "\n"


def _head(model: ArmModel) -> Iterator[str]:
    yield from _lines(name=model.name, source=model.source, home_rad=model.home_rad)
    if model.catalogue:
        yield from _lines(catalogue=model.catalogue)
    if model.home_yaw_rad:
        yield from _lines(home_yaw_deg=_degrees(model.home_yaw_rad))


def _tables(model: ArmModel, notes: Mapping[str, Sequence[str]]) -> Iterator[str]:
    yield from ("", *_comments(notes.get("base", ())), "[base]  # the foot of the arm, in its own base frame")
    yield from _lines(mass_kg=model.base_mass_kg, **_capsule(model.base_capsule))
    yield from ("", "[flange]  # in the frame of the last joint")
    yield from _lines(origin_xyz_m=model.flange_xyz_m, origin_rpy_rad=model.flange_rpy_rad)
    yield from ("", "[tool]  # in the flange frame: the plate frame's axes, its origin on the plate's top")
    yield from _lines(origin_xyz_m=model.plate_xyz_m, origin_rpy_rad=model.plate_rpy_rad)
    yield from _lines(pivot_above_plate_m=model.pivot_above_plate_m)
    for joint in model.joints:
        yield from ("", *_comments(notes.get(joint.name, ())), "[[joint]]", *_lines(**_joint(joint)))


def _joint(joint: Joint) -> dict[str, Any]:
    limits = {"lower_deg": joint.lower_rad, "upper_deg": joint.upper_rad}
    return {
        "name": joint.name,
        "origin_xyz_m": joint.origin_xyz_m,
        "origin_rpy_rad": joint.origin_rpy_rad,
        "axis": joint.axis,
        **{key: _degrees(limit) for key, limit in limits.items() if limit is not None},
        "max_velocity_deg_s": _degrees(joint.max_velocity_rad_s),
        "max_acceleration_deg_s2": _degrees(joint.max_acceleration_rad_s2),
        "max_jerk_deg_s3": _degrees(joint.max_jerk_rad_s3),
        "max_effort_nm": float(joint.max_effort_nm),
        "link_mass_kg": float(joint.link_mass_kg),
        **_capsule(joint.link_capsule),
        **({"hull_m": joint.link_hull_m} if joint.link_hull_m else {}),
    }


def _capsule(capsule: Capsule) -> dict[str, Any]:
    return {"capsule_from_m": capsule.from_m, "capsule_to_m": capsule.to_m, "capsule_radius_m": capsule.radius_m}


def _degrees(angle_rad: float) -> float:
    return round(math.degrees(angle_rad), _DECIMALS) + 0.0


def _lines(**entries: Any) -> Iterator[str]:
    """Yields one line for each entry, an array on one line with the brackets together; one of arrays takes several."""
    for key, value in entries.items():
        if isinstance(value, tuple) and value and isinstance(value[0], tuple):
            lines = (value[first : first + _IN_LINE] for first in range(0, len(value), _IN_LINE))
            yield from (f"{key} = [", *(f"  {_value(line)[1:-1]}," for line in lines), "]")
        elif isinstance(value, tuple):
            yield f"{key} = [{', '.join(_value(item) for item in value)}]"  # pyright: ignore[reportUnknownVariableType]
        else:
            yield f"{key} = {_value(value)}"


def _value(value: float | str | Vector) -> str:
    """Returns the value as TOML has it; tomli_w knows how texts and numbers are escaped."""
    if isinstance(value, tuple):
        return f"[{', '.join(map(_value, value))}]"
    return tomli_w.dumps({"x": value}).removeprefix("x = ").rstrip("\n")


def _comments(sentences: Sequence[str]) -> Iterator[str]:
    for sentence in sentences:
        plain = "".join(letter if letter.isprintable() else "?" for letter in sentence)
        yield from textwrap.wrap(plain, _WIDTH, initial_indent="# ", subsequent_indent="#   ")
