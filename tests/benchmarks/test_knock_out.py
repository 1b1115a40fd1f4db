"""Concealed cases and sessions of the rig, with all rules and without one, show what each rule is good for.

    KNOCK_OUT=trifle,SWAP=0 KNOCK_OUT_CASES=null,rig pytest -m benchmark -s tests/benchmarks/test_knock_out.py

diagnoses the cases of some tiers (all, if none are named) with every rule, and again without each of the rules that are
named (all that fired, if none are) or with another value of a threshold. A case is diagnosed again only where the rule
fired; one in which it never gave another answer than when it is off is unchanged. What has been done lies in
KNOCK_OUT_FOLDER and is not done again. It prints each case that changes, and of each rule how many cases it saves and
loses by `Outcome.worth`. A diagnosis takes 2 to 40 s of processor time.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from tests.benchmarks.knock_out.cases import CASES, Case
from tests.benchmarks.knock_out.rules import RULES, Rule, another
from tests.benchmarks.knock_out.running import Outcome, outcome

pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(8 * 3600)]


def cases() -> list[Case]:
    tiers = [tier for tier in os.environ.get("KNOCK_OUT_CASES", "").split(",") if tier]
    return [case for case in CASES if not tiers or case.tier in tiers]


def rules() -> list[Rule]:
    known = {rule.name: rule for rule in RULES}
    asked = [word for word in os.environ.get("KNOCK_OUT", "").split(",") if word]
    return [known[word] if word in known else another(word) for word in asked] or list(RULES)


def test_which_rules_save_cases(tmp_path: Path) -> None:
    folder = Path(os.environ.get("KNOCK_OUT_FOLDER", str(tmp_path)))
    chosen = cases()
    with np.errstate(all="ignore"):
        before = {case: outcome(case, folder) for case in chosen}
        for case, said in before.items():
            print(f"{case.id}: worth {said.worth(case):g} of {len(case.names)}: {said.told()}", flush=True)
        right = sum(said.worth(case) == len(case.names) for case, said in before.items())
        print(f"{right} of {len(chosen)} cases are right with every rule")
        for rule in rules():
            _compare(rule, before, folder)
    assert right > 0


def _compare(rule: Rule, before: Mapping[Case, Outcome], folder: Path) -> None:
    """Prints what changes without a rule, and how many cases it saves and loses."""
    fired = [case for case in before if rule.number or outcome(case, folder).fired.get(rule.name, 0)]
    saved = lost = 0
    for case in fired:
        with_it, without_it = outcome(case, folder), outcome(case, folder, rule)
        change = with_it.worth(case) - without_it.worth(case)
        saved, lost = saved + (change > 0), lost + (change < 0)
        if with_it.told() != without_it.told():
            print(f"  {rule.name}, {case.id}: {with_it.told()}; without: {without_it.told()}", flush=True)
    where = f"{'tried' if rule.number else 'fired'} in {len(fired)} of {len(before)}"
    print(f"{rule.name}: {where}, saved {saved}, lost {lost}", flush=True)
