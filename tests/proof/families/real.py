"""Real data with their labels dealt anew: friction depends on nothing there, and the noise is nature's.

404 tosses of a cube, silicone under 70 loads, and a step of the sliding speed; `tests/benchmarks/tosses.py` and
`real_tables.py` say how a copy is made. The folder is named by REPOSE_REAL_DATA, or lies beside the checkout.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType
from typing import ClassVar

from station.recording.importers import cube_tosses
from station.recording.importers import write as write_imported
from tests.benchmarks.real_tables import Silicone, SpeedStep
from tests.benchmarks.tosses import permuted, tosses_of, write_table
from tests.concealed.sealing import Origin, case_id, generator
from tests.proof.generator import ROOT
from tests.proof.planned import Plan, PlannedFamily, entry_of

FOLDER = Path(os.environ.get("REPOSE_REAL_DATA", ROOT.parent / "shared" / "data"))
SOURCES: Mapping[str, Path] = MappingProxyType(
    {
        "tosses": FOLDER / "cube-tosses" / "tosses.parquet",
        "cycles": FOLDER / "silicone-load" / "friction.csv",
        "means": FOLDER / "silicone-load" / "friction.csv",
        "steps": FOLDER / "velocity-steps" / "sepiolite.csv",
    }
)
FIRST_TIER = 200
"""Number of the first tier, beyond those of other generators: no case shares its random numbers with one of theirs."""


class Real(PlannedFamily):
    """Nulls only. A tier is a way to read a set of data."""

    name: ClassVar[str] = "real"
    title: ClassVar[str] = "real data, labels dealt anew"
    place: ClassVar[int] = 30
    quick: ClassVar[Mapping[str, int]] = MappingProxyType({})
    full: ClassVar[Mapping[str, int]] = MappingProxyType({"tosses": 20, "cycles": 30, "means": 30, "steps": 30})

    def why_not(self) -> str | None:
        """The data are not in the repository."""
        missing = [str(path) for path in SOURCES.values() if not path.is_file()]
        return f"there is no {missing[0]}; REPOSE_REAL_DATA names the folder of the data" if missing else None

    def plan(self, tier: str, index: int, *, seed: int) -> Plan:
        """A copy has no number but its own."""
        origin: Origin = (seed, FIRST_TIER + list(SOURCES).index(tier), index)
        return Plan(id=case_id(origin), entry=entry_of(tier, data=SOURCES[tier].name), made_from=(tier, origin))

    def write(self, plan: Plan, folder: Path, *, key: Path) -> None:
        """A session of tosses, or a table."""
        del key
        tier, origin = plan.made_from
        rng, source = generator(origin, "labels"), SOURCES[tier]
        with TemporaryDirectory(dir=folder) as unfinished:
            if tier == "tosses":
                path = Path(unfinished) / "session.mcap"
                write_imported(
                    cube_tosses.read(write_table(permuted(tosses_of(source), rng), path.with_suffix(".parquet"))), path
                )
            else:
                path = Path(unfinished) / "table.csv"
                if tier == "steps":
                    SpeedStep.of(source).dealt(path, rng)
                else:
                    getattr(Silicone.of(source).dealt(rng), tier)(path)
            path.replace(folder / path.name)
