"""A session does not start when its plan has a step that the arm cannot make."""

import dataclasses

import pytest

from shared.config import Table
from shared.errors import UserError
from station.app import assembly
from station.sampling.plan import DirectionPlan, Plan, TiltPlan

CURVED = dataclasses.replace(assembly.rig_from(None), arm=Table({"model": "jaco2_curved"}))


def test_the_simulated_rig_reaches_the_papers_plan():
    assembly.require_reachable(assembly.rig_from(None), Plan())


def test_what_is_out_of_reach_is_named_with_the_best_alternative():
    with pytest.raises(UserError, match=r"67.5 degrees in direction 2.*reaches 60.6.*some = \[0\]"):
        assembly.require_reachable(CURVED, Plan())


@pytest.mark.parametrize(
    "plan",
    [
        Plan(direction=DirectionPlan(some=(0,))),
        Plan(tilt=TiltPlan(max_deg=60.0)),
        Plan(direction=DirectionPlan(mode="free")),
    ],
)
def test_the_alternative_is_accepted(plan: Plan):
    assembly.require_reachable(CURVED, plan)
