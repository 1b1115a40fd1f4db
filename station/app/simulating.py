"""Opens what commands that simulate share: the rig of a recording, a model from its file, a simulator by its name."""

from __future__ import annotations

import sys
from pathlib import Path

from shared.config import Table, load_table
from shared.errors import UserError
from shared.rig import RigConfig, load_rig
from shared.visible import visible
from station.app.attached import attached_rig, effects_left_out
from station.physics.catalogue import catalogue_of_table
from station.physics.model import Model, model_of_table
from station.recording.arrays import load_signals
from station.recording.reader import RecordingReader, open_recording
from station.simulators.simulator import RecordedSimulation, Simulator, opened


def rig_of(reader: RecordingReader, *, path: Path | None = None) -> RigConfig:
    """Returns the rig of a recording: from the file at `path`, or else the one that the recording carries.

    Folders of effects that only the recording names are not loaded, and standard error says so.

    Raises:
        UserError: if there is none, or it cannot be read.
    """
    if path is not None:
        return load_rig(path)
    rig = attached_rig(reader)
    if rig is None:
        raise UserError(f"Expected a rig file inside {reader.path}, found none; give one with --rig")
    if named := effects_left_out(reader):
        print(
            f"{reader.path} was made with effects from {visible(', '.join(named))}; nothing that a recording names is "
            "loaded. To use them, give your own rig file with --rig",
            file=sys.stderr,
        )
    return rig


def model_of(path: Path, *, rig: RigConfig | None) -> Model:
    """Returns the model of a model.toml, with the rig's own effects at hand if there is one.

    Raises:
        UserError: if the file or an effect's folder cannot be read, or says something impossible.
    """
    try:
        return model_of_table(load_table(path).values, catalogue_of_table(rig.physics if rig else Table({})))
    except UserError as error:
        raise UserError(f"{path}: {error}") if str(path) not in str(error) else error from None


def simulator_of(name: str) -> Simulator:
    """Returns a simulator by its name, a file of the user's own, or a recording (.mcap) that another one made.

    Raises:
        UserError: if there is neither.
    """
    if name.endswith(".mcap"):
        return RecordedSimulation(load_signals(open_recording(Path(name))))
    return opened(name)
