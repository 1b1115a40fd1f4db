"""Families of other people's engines: nothing concealed, or effects as forces, in the draws, the arm and the camera.

Cases, strengths and sessions are the patch world's; its contact is not. With an engine's good settings the tool must be
silent. What an effect needs of the contact itself (a law of speed, say) is not tried here. An `artefact` is a
world of the engine with bad settings, in which nothing is concealed: what it does is no physics, and to be called none.
"""

from __future__ import annotations

import importlib.util
import json
from abc import abstractmethod
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import ClassVar

from shared.clock import SIMULATION_EPOCH_NS
from station.app.recordings import plan_toml
from station.recording.provenance import Provenance
from station.recording.writer import Recording
from tests.concealed.sealing import case_id, generator
from tests.proof.engine_bench import Engine, EngineBench
from tests.proof.families import Json
from tests.proof.families.patch_world import EXACT, INEXACT, RUNS, truth_of
from tests.proof.key import Truth
from tests.proof.parameters import Map
from tests.proof.patch_world import rig as rigs
from tests.proof.patch_world.bench import Bench
from tests.proof.patch_world.cases import Case, case_of_key, make_case
from tests.proof.patch_world.session import Session
from tests.proof.patch_world.truth import acted
from tests.proof.patch_world.world import Contact, World
from tests.proof.planned import Plan, PlannedFamily
from tests.proof.protocol import Protocol

CONCEALED: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "null": (),
        "artefact": (),
        "single": (
            "oil_film", "polishing", "leaning_base", "early_stamps", "bending_mast", "far_pivot", "barrel_lens",
            "loose_gear", "false_protractor", "shaking_arm", "crumbling_foam", "row_readout",
        ),
        "outside": ("magnet", "thread", "gusts", "warm_cold", "laid_nap", "slipped_camera"),
    }
)  # fmt: skip
FIRST_TIER = 300


class EngineFamily(PlannedFamily):
    """An engine's worlds; `module` is what must be installed."""

    module: ClassVar[str]
    number: ClassVar[int]
    """Its own, so that no two engines are given the same cases."""
    quick: ClassVar[Mapping[str, int]] = MappingProxyType({})
    full: ClassVar[Mapping[str, int]] = MappingProxyType({"null": 40, "single": 8, "outside": 4})

    @abstractmethod
    def engine(self, contact: Contact) -> Engine:
        """The engine with the block of these numbers."""

    def bad(self, contact: Contact) -> Engine:
        """The engine with bad settings: as it is, where it is nothing but artefacts."""
        return self.engine(contact)

    def why_not(self) -> str | None:
        """Engines are heavy, and no extra of ours."""
        missing = importlib.util.find_spec(self.module) is None
        return f"{self.module} is not installed: pip install --group engines" if missing else None

    def bench(self, world: World) -> Bench:
        """The bench of a world."""
        return EngineBench(world, self.engine(world.contact))

    def plan(self, tier: str, index: int, *, seed: int) -> Plan:
        """Each effect in turn, from one that the seed says."""
        origin = (seed, FIRST_TIER + 10 * self.number + list(CONCEALED).index(tier), index)
        names, rng = CONCEALED[tier], generator(origin, "design")
        ids = [names[(index + seed) % len(names)]] if names else []
        case = make_case(case_id(origin), tier if ids else "null", ids, seed=int(rng.integers(2**40)), runs=RUNS)
        return Plan(id=case.name, entry=case.key() | {"tier": tier}, made_from=case.key())

    def write(self, plan: Plan, folder: Path, *, key: Path) -> None:
        """The session, as the patch world writes one, and where its effects acted; its name says that all is there."""
        case, unfinished = case_of_key(plan.made_from), folder / "unfinished.mcap"
        artefact, contact = plan.entry["tier"] == "artefact", case.world.contact
        engine = self.bad(contact) if artefact else self.engine(contact)
        session = self._session(case, unfinished, EngineBench(case.world, engine))
        found = {
            name: acted(case.world, without, session.runs, seed=case.seed, bench_of=self.bench)
            for name, without in case.without.items()
        }
        _record(key, case.name).parent.mkdir(parents=True, exist_ok=True)
        _record(key, case.name).write_text(json.dumps(found) + "\n", encoding="utf-8")
        unfinished.replace(folder / "session.mcap")

    @staticmethod
    def _session(case: Case, path: Path, bench: Bench) -> Session:
        text, plan = rigs.rig_toml(case.plain.contact), rigs.plan(runs=RUNS, seed=case.seed % 2**31)
        (path.parent / "rig.toml").write_text(text, encoding="utf-8")
        provenance = Provenance(
            rig_id="patchworld", started_ns=SIMULATION_EPOCH_NS, mode="lockstep", seed=plan.seed, rig_toml=text,
            plan_toml=plan_toml(plan),
        )  # fmt: skip
        with Recording(path, provenance=provenance, overwrite=True, flush_every_s=60.0) as recording:
            rig = rigs.rig_config(text)
            session = Session(case.world, plan, recording, rig=rig, seed=case.seed, bench=bench)
            session.run()
        return session

    def truths(self, protocol: Protocol, tier: str, told: Json) -> Iterator[Truth]:
        """Yields the truths as the patch world's family does."""
        for name, entry in told["cases"].items():
            yield truth_of(entry, json.loads(_record(protocol.key(tier), name).read_text("utf-8")))

    def maps(self) -> Mapping[str, Map]:
        """The patch world's."""
        return EXACT

    def inexact(self) -> Mapping[str, str]:
        """See `maps`."""
        return INEXACT


def _record(key: Path, name: str) -> Path:
    return key / "truth" / f"{name}.json"
