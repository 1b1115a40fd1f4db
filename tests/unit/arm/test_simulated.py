"""The twin as an arm over the bus: what a joint state that does not fit the model does, and what ends it."""

from __future__ import annotations

import pytest

from shared.messages import JointState
from tests.unit.arm.conftest import FakeRig

OF_ANOTHER_ARM = JointState(1, ("knee",), (0.0,), (0.0,))


@pytest.mark.parametrize("state", [OF_ANOTHER_ARM, JointState(1, (), (), ())])
def test_the_arm_halts_for_a_state_of_other_joints_and_goes_on_with_its_own(state: JointState, rig: FakeRig) -> None:
    """One such state blocked the arm until its agent was started again."""
    assert rig.command(10).accepted
    rig.advance(0.5)
    rig.bus.publish("twin/joints", state)
    rig.agent.tick(rig.clock.now_ns())
    assert rig.reports[-1].fault.startswith("The arm reports the joints")
    rig.advance(1.0)
    assert rig.command(10).accepted
    rig.advance(3.0)
    assert rig.reports[-1].fault == ""
    assert rig.reports[-1].end_ns
