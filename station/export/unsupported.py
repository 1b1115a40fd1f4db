"""Tells in sentences what a measurement says and a format cannot: for the file's comment and for the terminal."""

from __future__ import annotations

import math

import numpy as np

from station.export.measured import Array, MeasuredPair

_NOTICED_RAD = math.radians(0.05)
_CIRCLE: Array = np.linspace(0, 2 * math.pi, 361)


def always_unsupported(pair: MeasuredPair) -> list[str]:
    """Returns the facts that no rigid-body format says.

    These are one-way friction, a second ellipse, other shapes, scatter and remarks.
    """
    said: list[str] = []
    if pair.one_way != 1.0:
        worst = math.degrees(abs(math.atan(pair.mu * math.sqrt(pair.one_way)) - math.atan(pair.mu)))
        said.append(
            f"One-way friction is left out: towards {math.degrees(pair.one_way_rad):.0f} degrees the object holds "
            f"{pair.one_way:.3f} times what it holds backwards; the angle of repose here is off by {worst:.2f} degrees "
            "either way."
        )
    if pair.other_ratio != 1.0:
        other = "plate" if pair.fixed_in == "object" else "object"
        said.append(
            f"The {other} has an ellipse of its own (ratio {pair.other_ratio:.3f}), which is left out; the one written "
            f"is fixed in the {pair.fixed_in}."
        )
    if pair.misfit_rad > _NOTICED_RAD and pair.one_way == 1.0:
        said.append(
            f"The measured limit curve is no ellipse: the one written is off by up to "
            f"{math.degrees(pair.misfit_rad):.2f} degrees."
        )
    return [*said, *_scatter(pair), *pair.remarks]


def no_kinetic(pair: MeasuredPair, *, engine: str) -> str:
    """Returns the sentence that an engine has one coefficient for rest and sliding."""
    if math.isnan(pair.kinetic_ratio):
        return f"{engine} has one coefficient for rest and sliding; kinetic friction was not measured."
    return (
        f"{engine} has one coefficient for rest and sliding; measured kinetic friction is {pair.kinetic_ratio:.3f} "
        "times the static friction that is written, so slides will be too slow."
    )


def no_anisotropy(pair: MeasuredPair, *, engine: str) -> list[str]:
    """Gives the sentence that an engine knows one number for all directions; empty where one number is all there is."""
    if pair.isotropic:
        return []
    high, low = (math.degrees(math.atan(mu) - math.atan(pair.mu)) for mu in (pair.mu_1, pair.mu_2))
    return [
        f"{engine} has one coefficient for all directions: the geometric mean {pair.mu:.4f} is written, and the object "
        f"slides {high:.2f} degrees too early along the {pair.fixed_in}'s axis of high friction and "
        f"{-low:.2f} degrees too late across it."
    ]


def pyramid_excess_rad(pair: MeasuredPair) -> float:
    """Gives the largest tilt by which a friction pyramid (|f_1| ≤ mu_1 N, |f_2| ≤ mu_2 N) lets go after the ellipse."""
    along = _CIRCLE - pair.axis_rad
    with np.errstate(divide="ignore"):
        corner = np.minimum(pair.mu_1 / np.abs(np.cos(along)), pair.mu_2 / np.abs(np.sin(along)))
    return float((np.arctan(corner) - pair.angle_rad(_CIRCLE)).max())


def _scatter(pair: MeasuredPair) -> list[str]:
    """Returns the sentence on the scatter that is left out; empty where runs do not scatter."""
    if math.isnan(pair.scatter):
        return ["Scatter from run to run is left out; the measurement does not state it."]
    if pair.scatter == 0.0:
        return []
    return [
        f"Scatter from run to run is left out: multiply both coefficients by exp({pair.scatter:.4f} z), "
        "z normal, once a run."
    ]
