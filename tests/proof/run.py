"""The protocol of one family from beginning to end: make and seal, run once, open, score."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rich.console import Console

from shared.rig import load_rig
from station.app.bars import bar
from station.app.work import work_on
from tests.proof.families import Family, recording_of
from tests.proof.generator import make_tier
from tests.proof.key import Truth, open_key
from tests.proof.protocol import Protocol
from tests.proof.refit import Refit, run_refit
from tests.proof.rivals import reasons, rivals
from tests.proof.said import Said, number, read_said
from tests.proof.scoring import Scored
from tests.proof.trial import Trial, run_trial, tool_digest

REFITTED = ("effects", "none")
"""Answers whose gates ask for a held-out score: how much of a gap was closed, and that nothing was lost on nulls."""

COMPARED = ("null", "single", "pair")
"""The kinds of cases that the rivals' figures are about."""


@dataclass(frozen=True, kw_only=True)
class Proof:
    """All cases of a family scored; the tiers that were not made and the rivals that did not run, with reasons."""

    family: Family
    cases: tuple[Scored, ...]
    seals: Mapping[str, str]
    digest: str
    not_made: Mapping[str, str]
    absent: Mapping[str, str]


def prove(family: Family, protocol: Protocol, *, jobs: int, rivalled: int, refits: bool, console: Console) -> Proof:
    """Runs whatever is missing and scores everything; rivals on up to `rivalled` cases of each kind of `COMPARED`.

    Raises:
        UserError: for a folder of other cases, for results of another version of the tool, or a key that was changed.
    """
    protocol.out.mkdir(parents=True, exist_ok=True)
    digest = tool_digest()
    why = family.why_not()
    not_made = dict.fromkeys(protocol.tiers, why) if why else _make(family, protocol, jobs, console)
    for tier, reason in not_made.items():
        console.print(f"{family.name}/{tier} is left out: {reason}", highlight=False, soft_wrap=True)
    made = [tier for tier in protocol.tiers if tier not in not_made]
    seals = json.loads(protocol.seals.read_text("utf-8")) if made else {}
    for tier in made:
        console.print(f"key of {family.name}/{tier}: sha256 {seals[tier]}", highlight=False)
    _try(protocol, made, digest=digest, jobs=jobs, console=console)
    # Only here is any key opened.
    truths = [truth for tier in made for truth in family.truths(protocol, tier, open_key(protocol, tier))]
    pairs = [(truth, read_said(protocol.result(truth.tier, truth.id), digest=digest)) for truth in truths]
    absent = reasons() if rivalled else {}
    if refits:
        able = tuple(name for name in rivals() if rivalled and name not in absent)
        compared = [truth for kind in COMPARED for truth in _first(truths, kind, rivalled)]
        tasks = [_task(protocol, truth, said, able if truth in compared else ()) for truth, said in pairs]
        work_on(
            [task for task in tasks if task is not None and not _done(task)],
            run_refit, jobs=jobs, title="oracle and rivals", console=console,
        )  # fmt: skip
    cases = tuple(_scored(family, protocol, truth, said, refits) for truth, said in pairs)
    kept = {tier: seals[tier] for tier in made}
    return Proof(family=family, cases=cases, seals=kept, digest=digest, not_made=not_made, absent=absent)


def _make(family: Family, protocol: Protocol, jobs: int, console: Console) -> dict[str, str]:
    """Makes and seals every tier; of those that could not be made the reason."""
    not_made: dict[str, str] = {}
    with bar(console) as progress:
        for tier in protocol.tiers:
            shown = progress.add_task(f"{family.name}/{tier}", total=protocol.tiers[tier])

            def tell(what: str, done: int, of: int, shown: Any = shown, tier: str = tier) -> None:
                progress.update(shown, description=f"{family.name}/{tier}: {what}", completed=done, total=of)

            why = make_tier(family, protocol, tier, jobs=jobs, tell=tell)
            progress.update(shown, description=f"{family.name}/{tier}: {'not made' if why else 'sealed'}")
            if why:
                not_made[tier] = why
                progress.console.print(f"{family.name}/{tier}: {why}")
            else:
                progress.update(shown, completed=protocol.tiers[tier], total=protocol.tiers[tier])
    return not_made


def _try(protocol: Protocol, tiers: Sequence[str], *, digest: str, jobs: int, console: Console) -> None:
    trials: list[Trial] = []
    for tier in tiers:
        for case in sorted(protocol.cases(tier).iterdir()):
            result = protocol.result(tier, case.name)
            if result.exists():
                read_said(result, digest=digest)
            elif recording_of(case) is not None:
                trials.append(Trial(case=case, result=result, digest=digest))
    work_on(trials, run_trial, jobs=jobs, title="diagnosing, once each", console=console)


def _first(truths: Sequence[Truth], kind: str, count: int) -> list[Truth]:
    """Up to so many of a kind, in the order of their names, which say nothing."""
    able = (truth for truth in truths if truth.kind == kind and truth.answer in REFITTED)
    return sorted(able, key=lambda truth: (truth.tier, truth.id))[:count]


def _task(protocol: Protocol, truth: Truth, said: Said, able: tuple[str, ...]) -> Refit | None:
    """None where there is nothing to compare: no true effect, no claim and no rival, or no gate that asks."""
    case = protocol.cases(truth.tier) / truth.id
    if said.fault is not None or truth.answer not in REFITTED or not (case / "session.mcap").exists():
        return None
    claimed: dict[str, Any] = said.answer["model"].get("effects", {}) if said.names else {}
    true = tuple(sorted(truth.ids)) if truth.answer == "effects" else ()
    if not (true or claimed or able):
        return None
    mu = number(said.answer["baseline"]["parameters"]["mu_s"]["value"])
    return Refit(
        case=case, result=protocol.refit(truth.tier, truth.id), true=true,
        said={name: claimed[name] for name in said.names if name in claimed}, mu_s=mu if mu > 0 else 0.4, rivals=able,
    )  # fmt: skip


def _done(task: Refit) -> bool:
    """True if the case was refitted with all of these rivals."""
    if not task.result.exists():
        return False
    return set(task.rivals) <= json.loads(task.result.read_text("utf-8"))["rivals"].keys()


def _scored(family: Family, protocol: Protocol, truth: Truth, said: Said, refits: bool) -> Scored:
    path = protocol.refit(truth.tier, truth.id)
    refit = json.loads(path.read_text("utf-8")) if refits and path.exists() else {}
    file = protocol.cases(truth.tier) / truth.id / "rig.toml"
    rig = load_rig(file) if file.exists() else None
    return Scored(truth=truth, said=said, rig=rig, refit=refit, maps=family.maps(), inexact=family.inexact())


def left_out(cases: Sequence[Scored]) -> dict[str, Counter[str]]:
    """Parameters that were not scored, with the reasons and how often."""
    total: dict[str, Counter[str]] = {}
    for case in cases:
        for name, why in case.pulls()[1].items():
            total.setdefault(name, Counter())[why] += 1
    return total
