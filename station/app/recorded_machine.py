"""Builds the state machine of a recorded session: with its plan, its seed and its rig."""

from __future__ import annotations

from dataclasses import replace

from shared.config import parse
from shared.errors import UserError
from shared.rig import RigConfig
from station.app import assembly
from station.app.attached import attached_rig, attached_table
from station.recording.reader import RecordingReader
from station.sampling.machine import SamplingMachine
from station.sampling.plan import Plan


def machine_of(reader: RecordingReader, *, seed: int | None = None, rig: RigConfig | None = None) -> SamplingMachine:
    """Gives a fresh machine with the plan (under another `seed`, if given) and the `rig` given, or inside a recording.

    Raises:
        UserError: if the recording is not of a session.
    """
    plan, rig = attached_table(reader, "plan.toml"), rig or attached_rig(reader)
    if plan is None or rig is None:
        missing = "rig.toml" if rig is None else "plan.toml"
        raise UserError(
            f"Expected {missing} inside {reader.path}, but it has none; only sessions can be replayed like this"
        )
    chosen = parse(Plan, plan)
    return assembly.sampling_machine(rig, chosen if seed is None else replace(chosen, seed=seed))
