"""The cases of the knock-out benchmark, with the right answer of each; the evidence is made once and pickled.

Cases of the concealed generator come by tier, number and seed. `strong` is a single effect at twelve detection limits,
where the misfit of its law stands out most. `rig` is a lockstep session of the simulated rig, whose camera sags.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cloudpickle
import numpy as np

from shared.clock import SIMULATION_EPOCH_NS
from shared.rig import load_rig
from station.app import assembly, recordings
from station.app.lockstep import Lockstep
from station.app.setting import setting_of
from station.diagnosis.observations.build import evidence_of
from station.diagnosis.observations.evidence import Evidence
from station.recording.arrays import load_signals
from station.recording.reader import open_recording
from station.recording.writer import Recording
from tests.concealed.cases import Plan, at_strength, write_case
from tests.concealed.catalogue import BEYOND, EFFECTS
from tests.concealed.sealing import case_id, generator
from tests.concealed.tiers import plan_case
from tests.recovery.rig_as_it_comes import rig_with

STRONG = 12.0
"""Detection limits: three times the strongest of the proof."""


@dataclass(frozen=True, kw_only=True)
class Case:
    """A case by its tier, number and seed; `names` are right, and `other` if what it conceals has no name."""

    tier: str
    number: int
    seed: int
    names: tuple[str, ...] = ()

    @property
    def id(self) -> str:
        """A name for files and tables."""
        return "-".join((self.tier, str(self.number), str(self.seed), *self.names))


def concealed(tier: str, numbers: Sequence[int], seed: int, names: Sequence[tuple[str, ...]] = ()) -> Iterator[Case]:
    """Cases of a tier of the generator."""
    for number, right in zip(numbers, names or [()] * len(numbers), strict=True):
        yield Case(tier=tier, number=number, seed=seed, names=right)


SINGLES = {
    75: "kinetic_drop",
    51: "stribeck",
    79: "contact_aging",
    55: "wear",
    31: "object_anisotropy",
    7: "plate_anisotropy",
    59: "friction_patch",
    87: "presliding",
    15: "platform_level",
    95: "clock_offset",
    71: "camera_sag",
    23: "rolling_shutter",
}
"""Each effect's case has a number in the tier, and a strength of four limits."""

PAIRS = {
    0: ("kinetic_drop", "viscous"),
    2: ("stribeck", "viscous"),
    3: ("platform_level", "one_way_friction"),
    4: ("camera_sag", "presliding"),
    5: ("object_anisotropy", "plate_anisotropy"),
    6: ("contact_aging", "wear"),
    8: ("contact_aging", "kinetic_drop"),
    13: ("clock_offset", "contact_aging"),
    14: ("camera_sag", "plate_anisotropy"),
    17: ("rate_strengthening", "friction_patch"),
}
OUTSIDE = tuple(BEYOND)[:7]
LARGE = ("kinetic_drop", "contact_aging", "wear", "plate_anisotropy", "friction_patch", "camera_sag")

CASES: tuple[Case, ...] = (
    *concealed("null", range(5), 20261350),
    *concealed("null_nuisance", range(3), 20261351),
    *concealed("single", list(SINGLES), 20261352, [(name,) for name in SINGLES.values()]),
    *concealed("pair", list(PAIRS), 20261353, list(PAIRS.values())),
    *concealed("outside", range(len(OUTSIDE)), 20261354, [("other",)] * len(OUTSIDE)),
    *concealed("absorbed", range(3), 20261355),
    *concealed("strong", range(len(LARGE)), 20261356, [(name,) for name in LARGE]),
    Case(tier="rig", number=40, seed=401, names=("camera_sag",)),
    Case(tier="rig", number=60, seed=20261357, names=("camera_sag",)),
    Case(tier="rig", number=60, seed=20261358, names=("camera_sag",)),
    Case(tier="still", number=60, seed=20261359),
    Case(tier="still", number=60, seed=20261360),
)
"""`rig` and `still` have as many samples as their number says; `still` is the rig without its sag."""


def evidence_of_case(case: Case, folder: Path) -> Evidence:
    """The evidence of a case, from `folder` if it has been made before."""
    kept = folder / f"{case.id}.pickle"
    if not kept.exists():
        with tempfile.TemporaryDirectory() as made:
            evidence = _made(case, Path(made))
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_bytes(cloudpickle.dumps(evidence))
    found: Evidence = cloudpickle.loads(kept.read_bytes())
    return found


def _made(case: Case, folder: Path) -> Evidence:
    path = _run(case, folder) if case.tier in ("rig", "still") else _written(case, folder)
    rig = load_rig(path.parent / "rig.toml") if case.tier not in ("rig", "still") else rig_with()
    return evidence_of(load_signals(open_recording(path)), setting_of(rig))


def _written(case: Case, folder: Path) -> Path:
    plan = _strong(case) if case.tier == "strong" else plan_case(case.tier, case.number, seed=case.seed)
    write_case(plan, folder)
    return folder / plan.id / "session.mcap"


def _strong(case: Case) -> Plan:
    origin = (case.seed, 0, case.number)
    setting, planted = at_strength(generator(origin, "design"), [EFFECTS[case.names[0]]], [STRONG])
    entry: dict[str, Any] = {"effects": [one.described(setting.world) for one in planted]}
    return Plan(id=case_id(origin), setting=setting, mu_guess=setting.world.mu, entry=entry, origin=origin)


def _run(case: Case, folder: Path) -> Path:
    rig = rig_with(sag_px=0.0 if case.tier == "still" else None)
    plan, path = assembly.plan_from(None, samples=case.number, seed=case.seed), folder / "session.mcap"
    origin = recordings.provenance(rig, plan, mode="lockstep", started_ns=SIMULATION_EPOCH_NS)
    with Recording(path, provenance=origin, overwrite=True, flush_every_s=10.0) as recording:
        outcome = Lockstep(rig, plan, recording=recording).run()
    assert not outcome.fault, outcome.fault
    return path


def main(folder: Path, *numbers: str) -> None:
    """Makes all evidence, or that of some cases."""
    folder.mkdir(parents=True, exist_ok=True)
    chosen = [CASES[int(number)] for number in numbers] or CASES
    for case in chosen:
        evidence = evidence_of_case(case, folder)
        print(case.id, evidence.used(), [len(channel) for channel in evidence.channels], flush=True)


if __name__ == "__main__":
    np.seterr(all="ignore")
    main(Path(sys.argv[1]), *sys.argv[2:])
