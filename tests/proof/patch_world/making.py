"""Makes a folder of cases: the key first, sealed by its SHA-256, then each recording with the truth about it."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from shared.clock import SIMULATION_EPOCH_NS
from shared.errors import UserError
from station.app.recordings import plan_toml
from station.pool import spread
from station.recording.provenance import Provenance
from station.recording.writer import Recording, partial_path
from station.sampling.plan import Plan
from tests.proof.patch_world import rig as rigs
from tests.proof.patch_world.cases import case_of_key, draw_ids, make_case
from tests.proof.patch_world.session import Session
from tests.proof.patch_world.truth import acted
from tests.proof.patch_world.world import World

VERSION = 2
"""The generator's version: another one may make other bytes of the same arguments."""
KEY, TRUTH, RECORDING, RIG = "key.json", "truth", "session.mcap", "rig.toml"


@dataclass(frozen=True, kw_only=True)
class Order:
    """An order of cases: so many of a tier, of so many runs each; `only` names the effects to choose from."""

    out: Path
    tier: str
    cases: int
    seed: int
    runs: int = 120
    only: tuple[str, ...] = ()
    key: Path | None = None

    @property
    def keys(self) -> Path:
        """The folder of the key and the truth."""
        return self.key or self.out

    def header(self) -> dict[str, Any]:
        """Returns what the key says of the order."""
        asked = {"tier": self.tier, "count": self.cases, "seed": self.seed, "runs": self.runs, "only": list(self.only)}
        return {"generator": "patch_world", "version": VERSION, **asked}

    def numbered(self) -> list[tuple[int, tuple[str, ...]]]:
        """Number and effects of each case."""
        return list(enumerate(draw_ids(self.tier, self.cases, seed=self.seed, only=self.only), start=1))


def name_of(number: int) -> str:
    """The folder of a case, which says nothing about it."""
    return f"{number:03d}"


def seal(order: Order, *, jobs: int) -> str:
    """Writes the key, unless this order's is there already; returns its SHA-256.

    Raises:
        UserError: if the folder holds the key of another order.
    """
    path = order.keys / KEY
    if path.exists():
        content = path.read_bytes()
        held = {name: value for name, value in json.loads(content).items() if name != "cases"}
        if held != order.header():
            raise UserError(f"Expected a folder of this order, but {path} is of {held}; choose another --out")
        return hashlib.sha256(content).hexdigest()
    with spread(partial(_key_of, order), order.numbered(), jobs=jobs) as made:
        keys = list(made)
    content = (json.dumps({**order.header(), "cases": keys}, indent=1, sort_keys=True) + "\n").encode()
    order.keys.mkdir(parents=True, exist_ok=True)
    _write(path, content)
    return hashlib.sha256(content).hexdigest()


def make(order: Order, *, jobs: int, tell: Callable[[str], None]) -> None:
    """Makes the recordings that are not there yet."""
    (order.keys / TRUTH).mkdir(parents=True, exist_ok=True)
    keys = json.loads((order.keys / KEY).read_bytes())["cases"]
    todo = [key for key in keys if not _truth_path(order, key["case"]).exists()]
    with spread(partial(_record, order), todo, jobs=jobs) as lines:
        for line in lines:
            tell(line)


def _key_of(order: Order, numbered: tuple[int, Sequence[str]]) -> dict[str, Any]:
    number, ids = numbered
    seed = order.seed * 100_003 + number * 101 + sum(map(ord, order.tier)) * 1_000_003
    return make_case(name_of(number), order.tier, ids, seed=seed, runs=order.runs).key()


def _record(order: Order, key: dict[str, Any]) -> str:
    """Makes one recording; the truth is written last, so that its file says that the case is whole."""
    case, folder = case_of_key(key), order.out / key["case"]
    folder.mkdir(parents=True, exist_ok=True)
    partial_path(folder / RECORDING).unlink(missing_ok=True)
    text, plan = rigs.rig_toml(case.plain.contact), rigs.plan(runs=order.runs, seed=case.seed % 2**31)
    (folder / RIG).write_text(text, encoding="utf-8")
    session, fault = record(folder / RECORDING, case.world, plan, rig_toml=text, seed=case.seed)
    digest = hashlib.sha256((folder / RECORDING).read_bytes()).hexdigest()
    truth = {
        "case": case.name,
        "session_sha256": digest,
        "fault": fault,
        "acted": {one: acted(case.world, world, session.runs, seed=case.seed) for one, world in case.without.items()},
    }
    _write(_truth_path(order, case.name), (json.dumps(truth, sort_keys=True) + "\n").encode())
    ended = f", ended because: {fault}" if fault else ""
    return f"{case.name}: {len(session.runs)} runs, {session.bench.time_s:.0f} s{ended}"


def record(path: Path, world: World, plan: Plan, *, rig_toml: str, seed: int) -> tuple[Session, str]:
    """Records a session of a world by a plan; returns it, and an empty text or why it stopped."""
    provenance = Provenance(
        rig_id="patchworld", started_ns=SIMULATION_EPOCH_NS, mode="lockstep", seed=plan.seed, rig_toml=rig_toml,
        plan_toml=plan_toml(plan),
    )  # fmt: skip
    with Recording(path, provenance=provenance, overwrite=True, flush_every_s=60.0) as recording:
        session = Session(world, plan, recording, rig=rigs.rig_config(rig_toml), seed=seed)
        return session, session.run()


def _truth_path(order: Order, name: str) -> Path:
    return order.keys / TRUTH / f"{name}.json"


def _write(path: Path, content: bytes) -> None:
    """Writes a file that is either whole or not there."""
    unfinished = path.with_suffix(".unfinished")
    unfinished.write_bytes(content)
    os.replace(unfinished, path)
