"""A table of measurements against the table that a simulation made for the same rows."""

from __future__ import annotations

from pathlib import Path

from shared.errors import UserError
from station.diagnosis.diagnose import Examined, evidence_from
from station.diagnosis.given import against_given
from station.diagnosis.observations.setting import Setting
from station.diagnosis.result import Diagnosis
from station.diagnosis.search.search import Progress
from station.physics.catalogue import Catalogue
from station.recording.measured import read_measured

TABLES = (".csv", ".parquet")


def refuse_no_table(simulate: object) -> Path:
    """Gives the path of a simulated table; refuses, before anything is computed, what a table cannot be compared with.

    Raises:
        UserError: if it is no table.
    """
    if not isinstance(simulate, str | Path) or Path(simulate).suffix not in TABLES:
        raise UserError(f"Expected a simulated table (.csv, .parquet) together with a table, got {simulate}")
    return Path(simulate)


def against_table(
    examined: Examined, known: Catalogue, *, setting: Setting, simulate: object, progress: Progress
) -> Diagnosis:
    """Returns the diagnosis of a table with a simulated table in place of the plain model.

    Raises:
        UserError: if the simulated table cannot be read, or measures another kind of friction.
    """
    path = refuse_no_table(simulate)
    simulated = read_measured(path)
    if examined.found is None:
        return examined.diagnosis
    mine, theirs = examined.found.evidence, evidence_from(simulated, setting)
    for name, words in (("onset", "at rest"), ("along", "while sliding")):
        if mine.channel(name) is not None and theirs.channel(name) is None:
            raise UserError(f"Expected a simulated table with friction {words}, as the measured one has, in {path}")
    return against_given(examined, simulated, known, setting=setting, name=str(path), progress=progress).diagnosis
