"""A recorded session simulated again: the same commands, each run from its recorded pose, with a model of friction."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from rich.console import RenderableType
from rich.text import Text

from shared.errors import UserError
from shared.installed import missing_as_user_error
from shared.messages import Sample
from shared.rig import RigConfig
from station.app import simulating
from station.app.attached import SIMULATED_FROM
from station.app.front.page import fragment
from station.app.front.recording import FilePath, Recording, opened, path_of
from station.app.front.seeds import seed_of
from station.app.front.table import Table
from station.app.onset_differences import difference, in_sum, of_scatter
from station.app.planting import plain_model
from station.app.planting import plant as planted
from station.app.simulated_recording import write_simulated
from station.pages import pieces
from station.pages.caption import made_by
from station.physics.catalogue import catalogue_of_table
from station.physics.model import Model, model_of_table, table_of_model
from station.signals.session import Signals
from station.simulators.recorded_runs import poses_of
from station.simulators.rerun import errors
from station.simulators.simulator import OwnFriction, RecordedSimulation, names


@missing_as_user_error()
def simulate(
    recording: Recording | FilePath,
    model: FilePath | Mapping[str, Any] | None = None,
    *,
    plant: Sequence[str] = (),
    simulator: str = "planar",
    rig: FilePath | None = None,
    seed: int | None = None,
) -> Simulated:
    """Simulates a recorded session again, as `station simulate` does.

    Args:
        recording: a recording, or the path of one.
        model: the path of a model.toml, or its tables: {"friction": {"mu_s": 0.35}}, or the `model` of a diagnosis;
            None: the median friction of the recorded runs.
        plant: effects to add, such as "kinetic_drop=0.3" or "stribeck.speed_m_s=0.05".
        simulator: "planar" or "mujoco".
        rig: the path of a rig file; None: the one inside the recording.
        seed: draws scatter, shaking and the corners' noise; None: nothing is left to chance.

    Raises:
        UserError: if a file or a model cannot be read, or the recording lacks what a simulation needs.
    """
    recorded = opened(recording)
    config = recorded.rig(rig)
    chosen, text = _model(model, config) if model is not None else _plain(recorded)
    if plant:
        chosen = planted(plant, chosen, catalogue_of_table(config.physics))
        text = tomli_w.dumps(table_of_model(chosen))
    rng = None if seed is None else np.random.default_rng(seed_of(seed))
    engine = simulating.simulator_of(simulator)
    if isinstance(engine, OwnFriction) and not isinstance(engine, RecordedSimulation):
        raise UserError(
            f"Expected {' or '.join(names())} to simulate with a model, but {simulator} has a friction of its own: "
            "station diagnose --simulate runs it as it is, and with what was found"
        )
    signals = engine.repeat(recorded.signals, chosen, rig=config, rng=rng)
    said = {SIMULATED_FROM: Path(recorded.name).name, "simulator": simulator}
    if seed is not None:
        said["simulation_seed"] = str(seed)
    scatter = math.nan if isinstance(engine, OwnFriction) else chosen.scatter
    return Simulated(recorded, signals, rig=config, said=said, model_toml=text, scatter=scatter)


def _model(model: FilePath | Mapping[str, Any], rig: RigConfig) -> tuple[Model, str]:
    """Returns the model and its text as model.toml."""
    if isinstance(model, Mapping):
        return model_of_table(model, catalogue_of_table(rig.physics)), tomli_w.dumps(dict(model))
    path = path_of(model, expected="the path of a model.toml or its tables")
    return simulating.model_of(path, rig=rig), path.read_text(encoding="utf-8")


def _plain(recorded: Recording) -> tuple[Model, str]:
    model = plain_model(recorded.signals.samples)
    return model, tomli_w.dumps(table_of_model(model))


class Simulated(Recording):
    """A recorded session in simulation: the tables of a `Recording`, as the simulator made them.

    `recorded` is the recording that it repeats. Tables of what is not simulated (the commands, say) are the recorded
    ones.
    """

    def __init__(
        self,
        recorded: Recording,
        signals: Signals,
        *,
        rig: RigConfig,
        said: Mapping[str, str],
        model_toml: str,
        scatter: float = 0.0,
    ) -> None:
        """Takes what was simulated; `said` and `model_toml` go into the recording that `write` makes.

        `scatter` is that of the model's friction from run to run, relative to its mean; nan where it is not known.
        """
        super().__init__(recorded.reader)
        self.recorded = recorded
        self.signals = signals
        self.every_sample = signals.samples
        self._rig, self._said, self._model_toml, self._scatter = rig, said, model_toml, scatter

    @property
    def name(self) -> str:
        """The simulator, and the path of the recording."""
        return f"{self._said['simulator']} simulation of {self.recorded.name}"

    @cached_property
    def differences(self) -> Table:
        """A row for each run: its onset (degrees, simulated − recorded), and how far apart paths and yaws are.

        `path_mm` and `turn_deg` are the root mean square distance and difference of the yaws over the frames from the
        recorded onset to the run's end. All are nan where there is nothing to compare.
        """
        found = errors(self.recorded.signals, self.signals)
        own = {"run": found.run, "onset_deg": found.onset_deg, "path_mm": found.path_mm, "turn_deg": found.turn_deg}
        return self._table("differences", own)

    def write(self, path: FilePath, *, on_message: Callable[[int], None] = lambda _: None) -> int:
        """Writes it as a recording (.mcap); gives the number of messages, without those that are added for viewers.

        `on_message` is called with the number of recorded messages that are done, after each.

        Raises:
            UserError: if the file exists or cannot be written.
        """
        return write_simulated(
            self.reader, self.signals, Path(path), rig=self._rig, said=self._said, model_toml=self._model_toml,
            on_message=on_message,
        )  # fmt: skip

    def _shown(self) -> Sequence[RenderableType]:
        return [f"{self.name}:", *map(Text, self.apart)]

    @property
    def apart(self) -> list[str]:
        """Lines that say how far the simulated onsets are from the recorded ones, and what is to be expected."""
        return [*difference(*self._both), *self._expected()]

    def _expected(self) -> list[str]:
        return of_scatter(self._scatter, drawn="simulation_seed" in self._said)

    @property
    def _both(self) -> tuple[Sequence[Sample], Sequence[Sample]]:
        return self.recorded.signals.samples, self.every_sample

    def _repr_html_(self) -> str:
        """Returns the same with a figure, for a notebook."""
        from station.app.front.figures import again  # noqa: PLC0415  # matplotlib is slow to load

        paths = poses_of(self.recorded.signals), poses_of(self.signals)
        lines = [self.name, *in_sum(*self._both), *self._expected()]
        with made_by(f"station.simulate({self.recorded.name!r}, model)"):
            return fragment(*map(pieces.paragraph, lines), again(*self._both, paths))
