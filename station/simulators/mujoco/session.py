"""Repeats a recorded session in MuJoCo."""

from __future__ import annotations

from functools import partial

import numpy as np

from shared.rig import RigConfig
from station.physics.model import Model
from station.signals.session import Signals
from station.simulators.mujoco.batch import SHARE, SHARE_CREEPING, simulate
from station.simulators.mujoco.own_settings import own_setup
from station.simulators.mujoco.tilted import Setup
from station.simulators.planar.session import repeated


class MujocoSession:
    """Repeats recorded sessions in MuJoCo: with given settings, or the rig file's, or those that hold a block well."""

    def __init__(self, setup: Setup | None = None) -> None:
        self._setup = setup

    def repeat(
        self, recorded: Signals, model: Model, *, rig: RigConfig, rng: np.random.Generator | None = None
    ) -> Signals:
        """Repeats as `Simulator.repeat` says; raises UserError also for settings in the rig file that cannot be."""
        setup = self._setup or own_setup(rig) or Setup()
        # A user's settings may let a block creep long before its onset; that creep is then to be simulated.
        share = SHARE_CREEPING if setup.solid else SHARE
        simulated = partial(simulate, setup=setup, share=share)
        return repeated(recorded, model, rig=rig, rng=rng, simulated=simulated)
