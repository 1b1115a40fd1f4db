"""A recorded session again, in MuJoCo."""

from __future__ import annotations

from functools import partial

import numpy as np

from shared.rig import RigConfig
from station.physics.model import Model
from station.signals.session import Signals
from station.simulators.mujoco.batch import simulate
from station.simulators.mujoco.tilted import Setup
from station.simulators.planar.session import repeated


class MujocoSession:
    """Repeats recorded sessions in MuJoCo, by default with the settings that hold a block rightly."""

    def __init__(self, setup: Setup | None = None) -> None:
        self._setup = setup or Setup()

    def repeat(
        self, recorded: Signals, model: Model, *, rig: RigConfig, rng: np.random.Generator | None = None
    ) -> Signals:
        """As `Simulator.repeat` says."""
        return repeated(recorded, model, rig=rig, rng=rng, simulated=partial(simulate, setup=self._setup))
