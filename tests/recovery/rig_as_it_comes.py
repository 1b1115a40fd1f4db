"""Sessions of the simulated rig as `station run --lockstep` makes them, and what the diagnosis says of each."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from rich.console import Console, RenderableType

from shared.clock import SIMULATION_EPOCH_NS
from shared.config import Table
from shared.rig import RigConfig
from station.app import assembly, recordings
from station.app.diagnosing import diagnose_file
from station.app.lockstep import Lockstep
from station.diagnosis.report.summary import summary
from station.recording.writer import Recording

SAMPLES = 120
WIDTH = 150


@dataclass(frozen=True, kw_only=True)
class Said:
    """The diagnosis of one session: the verdict, the effects claimed with their chances, and the global p.

    `printed` is what the terminal shows of it, in lines of WIDTH characters.
    """

    seed: int
    verdict: str
    claimed: dict[str, float]
    global_p: float
    printed: str


def rig_with(*, sag_px: float | None = None) -> RigConfig:
    """The simulated rig as it comes, or with another sag of its camera."""
    rig = assembly.rig_from(None)
    return rig if sag_px is None else replace(rig, camera=replace(rig.camera, options=Table({"sag_px": sag_px})))


def said_of(rig: RigConfig, *, seed: int, folder: Path) -> Said:
    """Runs, records and diagnoses a session; its recording is deleted."""
    path, plan = folder / "sim.mcap", assembly.plan_from(None, samples=SAMPLES, seed=seed)
    origin = recordings.provenance(rig, plan, mode="lockstep", started_ns=SIMULATION_EPOCH_NS)
    with Recording(path, provenance=origin, overwrite=True, flush_every_s=10.0) as recording:
        outcome = Lockstep(rig, plan, recording=recording).run()
    assert outcome.fault == ""
    found = diagnose_file(path).diagnosis
    path.unlink()
    claimed = {effect.id: effect.probability for effect in found.effects if effect.id in found.names}
    return Said(
        seed=seed, verdict=found.verdict, claimed=claimed, global_p=found.global_p, printed=_printed(summary(found))
    )


def _printed(shown: RenderableType) -> str:
    console = Console(width=WIDTH, no_color=True, highlight=False)
    with console.capture() as lines:
        console.print(shown)
    return lines.get()
