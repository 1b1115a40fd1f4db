"""An elliptic limit curve as an effect, in the words of the exact slider."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.model import Model, Term
from station.physics.parameter import Parameter
from station.simulators.slider import LimitCurve


class Ellipse(Effect):
    """Friction `ratio` along `axis_rad` over that across it; the geometric mean is the model's."""

    id: ClassVar[str] = "ellipse"
    title: ClassVar[str] = "ellipse"
    law: ClassVar[str] = "h² = mu² (r cos² + sin²/r)"
    source: ClassVar[str] = "geometry"
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "direction law"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="ratio", unit="1", low=0.2, high=5.0, typical=1.2, null=1.0),
        Parameter(name="axis_rad", unit="rad", low=-4.0, high=4.0, typical=1.0, null=None, starts=(0.0,)),
    )
    separated_by: ClassVar[str] = "nothing: it is for tests"

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """The support function of the ellipse."""
        turn, ratio = contact.way_rad - values["axis_rad"], values["ratio"]
        return np.sqrt(ratio * np.cos(turn) ** 2 + np.sin(turn) ** 2 / ratio)


def model_of(curve: LimitCurve) -> Model:
    """The same friction for the planar simulator."""
    values = {"ratio": curve.mu_along / curve.mu_across, "axis_rad": curve.axis_rad}
    return Model(mu_s=math.sqrt(curve.mu_along * curve.mu_across), terms=(Term(Ellipse(), values),))
