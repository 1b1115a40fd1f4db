"""The channels of another angle sensor: what it reads against the arm's attitude, as a model corrects it."""

from __future__ import annotations

from collections.abc import Callable

from station.diagnosis import thresholds
from station.diagnosis.observations.channel import Channel, Rows
from station.physics.contact import Array
from station.physics.model import Model


class Sensor(Channel):
    """Another angle sensor minus the arm's attitude, rad, less what the sensor's mounting explains.

    Rows are means of readings, and `off` gives their residuals (n,), rad, under a model. Their `level_tells` if the
    mounting leaves it as it is.
    """

    phase: str = "pre-slip"
    unit: str = "rad"
    trusted: float = thresholds.ANGLE_TRUSTED_RAD

    def __init__(
        self, rows: Rows, source: str, title: str, off: Callable[[Model], Array], *, level_tells: bool
    ) -> None:
        super().__init__(rows)
        self.name, self.title, self.level_tells = f"sensor:{source}", title, level_tells
        self._off = off

    def residual(self, model: Model) -> Array:
        """Returns recorded minus predicted difference (n,), rad."""
        return self._off(model)
