"""A table of measurements against the table that a simulation made for the same rows."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from shared.errors import UserError
from station.diagnosis.diagnose import Examined, evidence_from
from station.diagnosis.given import against_given
from station.diagnosis.observations.setting import Setting
from station.diagnosis.result import Diagnosis
from station.diagnosis.search.search import Progress
from station.physics.catalogue import Catalogue
from station.recording.measured import read_measured
from station.signals.measured import Measured

TABLES = (".csv", ".parquet")


@dataclass(frozen=True, kw_only=True)
class SimulatedTable:
    """A table that a simulation made, with its path as results call it."""

    name: str
    rows: Measured


def table_of(simulate: object) -> SimulatedTable:
    """Reads a simulated table, before anything is computed.

    Raises:
        UserError: if it is no table, or cannot be read.
    """
    if not isinstance(simulate, str | Path) or Path(simulate).suffix not in TABLES:
        raise UserError(f"Expected a simulated table (.csv, .parquet) together with a table, got {simulate}")
    return SimulatedTable(name=str(simulate), rows=read_measured(Path(simulate)))


def against_table(
    examined: Examined, known: Catalogue, *, setting: Setting, simulated: SimulatedTable, progress: Progress
) -> Diagnosis:
    """Returns the diagnosis of a table with a simulated table in place of the plain model.

    Raises:
        UserError: if the simulated table measures another kind of friction.
    """
    if examined.found is None:
        return examined.diagnosis
    mine, theirs = examined.found.evidence, evidence_from(simulated.rows, setting)
    for name, words in (("onset", "at rest"), ("along", "while sliding")):
        if mine.channel(name) is not None and theirs.channel(name) is None:
            raise UserError(
                f"Expected a simulated table with friction {words}, as the measured one has, in {simulated.name}"
            )
    return against_given(
        examined, simulated.rows, known, setting=setting, name=simulated.name, progress=progress
    ).diagnosis
