"""The protocol from beginning to end: make and seal, run once, open, score."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rich.console import Console

from shared.errors import UserError
from shared.rig import load_rig
from station.prove.generator import make_tier
from station.prove.key import Truth, open_key
from station.prove.protocol import Protocol
from station.prove.refit import Refit, run_refit
from station.prove.rivals import reasons, rivals
from station.prove.said import Said, number, read_said
from station.prove.scoring import Scored
from station.prove.trial import Tool, Trial, run_trial, tool_digest
from station.prove.workers import bar, work_on

REFITTED = ("effects", "none")
"""Answers whose gates ask for a held-out score: how much of a gap was closed, and that nothing was lost on nulls."""

COMPARED = ("null", "single", "pair")
"""The tiers whose cases the rivals' figures are about."""


@dataclass(frozen=True, kw_only=True)
class Proof:
    """All cases scored; the tiers that were not made and the rivals that did not run, with reasons."""

    cases: tuple[Scored, ...]
    seals: Mapping[str, str]
    digest: str
    not_made: Mapping[str, str]
    absent: Mapping[str, str]


def prove(protocol: Protocol, tool: Tool, *, jobs: int, rivalled: int, refits: bool, console: Console) -> Proof:
    """Runs whatever is missing and scores everything; rivals on up to `rivalled` cases of each tier of `COMPARED`.

    Raises:
        UserError: without a checkout, for a folder of other cases or of another version of the tool, a changed key.
    """
    protocol.out.mkdir(parents=True, exist_ok=True)
    digest = tool_digest()
    not_made = _make(protocol, jobs, console)
    made = [tier for tier in protocol.tiers if tier not in not_made]
    if not made:
        raise UserError("; ".join(f"tier {tier}: {why}" for tier, why in not_made.items()))
    seals = json.loads(protocol.seals.read_text("utf-8"))
    for tier in made:
        console.print(f"key of {tier}: sha256 {seals[tier]}", highlight=False)
    _try(protocol, made, tool, digest=digest, jobs=jobs, console=console)
    # Only here is any key opened.
    truths = [truth for tier in made for truth in open_key(protocol, tier).values()]
    said = {truth.id: read_said(protocol.result(truth.tier, truth.id), digest=digest) for truth in truths}
    absent = reasons() if rivalled else {}
    if refits:
        able = tuple(name for name in rivals() if rivalled and name not in absent)
        compared = {truth.id for tier in COMPARED for truth in _first(truths, tier, rivalled)}
        tasks = [_task(protocol, truth, said[truth.id], tool, able if truth.id in compared else ()) for truth in truths]
        work_on(
            [task for task in tasks if task is not None and not _done(task)],
            run_refit, jobs=jobs, title="oracle and rivals", console=console,
        )  # fmt: skip
    cases = tuple(_scored(protocol, truth, said[truth.id], refits) for truth in truths)
    return Proof(
        cases=cases, seals={tier: seals[tier] for tier in made}, digest=digest, not_made=not_made, absent=absent
    )


def _make(protocol: Protocol, jobs: int, console: Console) -> dict[str, str]:
    """Makes and seals every tier; of those that could not be made the reason."""
    not_made: dict[str, str] = {}
    with bar(console) as progress:
        for tier in protocol.tiers:
            shown = progress.add_task(f"making {tier}", total=protocol.tiers[tier])

            def tell(what: str, done: int, of: int, shown: Any = shown, tier: str = tier) -> None:
                progress.update(shown, description=f"{tier}: {what}", completed=done, total=of)

            why = make_tier(protocol, tier, jobs=jobs, tell=tell)
            progress.update(shown, description=f"{tier}: {'not made' if why else 'sealed'}")
            if why:
                not_made[tier] = why
                progress.console.print(f"tier {tier}: {why}")
            else:
                progress.update(shown, completed=protocol.tiers[tier], total=protocol.tiers[tier])
    return not_made


def _try(protocol: Protocol, tiers: Sequence[str], tool: Tool, *, digest: str, jobs: int, console: Console) -> None:
    trials: list[Trial] = []
    for tier in tiers:
        for case in sorted(protocol.cases(tier).iterdir()):
            result = protocol.result(tier, case.name)
            if result.exists():
                read_said(result, digest=digest)
            elif (case / "session.mcap").exists():
                trials.append(Trial(tool=tool, case=case, result=result, digest=digest))
    work_on(trials, run_trial, jobs=jobs, title="diagnosing, once each", console=console)


def _first(truths: Sequence[Truth], tier: str, count: int) -> list[Truth]:
    """Up to so many of a tier, in the order of their names, which are drawn at random."""
    return sorted((truth for truth in truths if truth.tier == tier), key=lambda truth: truth.id)[:count]


def _task(protocol: Protocol, truth: Truth, said: Said, tool: Tool, able: tuple[str, ...]) -> Refit | None:
    """None where there is nothing to compare: no true effect, no claim and no rival, or no gate that asks."""
    if said.fault is not None or truth.answer not in REFITTED:
        return None
    claimed: dict[str, Any] = said.answer["model"].get("effects", {}) if said.names else {}
    true = tuple(sorted(truth.ids)) if truth.answer == "effects" else ()
    if not (true or claimed or able):
        return None
    mu = number(said.answer["baseline"]["parameters"]["mu_s"]["value"])
    return Refit(
        tool=tool, case=protocol.cases(truth.tier) / truth.id, result=protocol.refit(truth.tier, truth.id), true=true,
        said={name: claimed[name] for name in said.names if name in claimed}, mu_s=mu if mu > 0 else 0.4, rivals=able,
    )  # fmt: skip


def _done(task: Refit) -> bool:
    """True if the case was refitted with all of these rivals."""
    if not task.result.exists():
        return False
    return set(task.rivals) <= json.loads(task.result.read_text("utf-8"))["rivals"].keys()


def _scored(protocol: Protocol, truth: Truth, said: Said, refits: bool) -> Scored:
    path = protocol.refit(truth.tier, truth.id)
    refit = json.loads(path.read_text("utf-8")) if refits and path.exists() else {}
    rig = load_rig(protocol.cases(truth.tier) / truth.id / "rig.toml")
    return Scored(truth=truth, said=said, rig=rig, refit=refit)


def left_out(cases: Sequence[Scored]) -> dict[str, Counter[str]]:
    """Parameters that were not scored, with the reasons and how often."""
    total: dict[str, Counter[str]] = {}
    for case in cases:
        for name, why in case.pulls()[1].items():
            total.setdefault(name, Counter())[why] += 1
    return total
