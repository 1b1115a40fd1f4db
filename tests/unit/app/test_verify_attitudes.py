"""`station verify` derives the plate's attitudes from the joints again, and finds what was changed of either."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shared.messages import JointState, PlatformState
from station.app import assembly
from station.app.attitudes_again import SAME, attitudes_again
from station.app.verifying import verify
from station.arm.attitude import Attitude
from station.arm.drivers import JointReading
from station.arm.tilter import Tilter
from station.recording.provenance import Provenance
from station.recording.reader import open_recording
from station.recording.writer import Recording
from station.rig.arm_settings import arm_settings
from station.rig.placed_arm import placed_arm
from tests.unit.app.forging import Item, forged

READINGS = 300
RIG = assembly.rig_from(None)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Joints of an arm that moves, and what the arm agent makes of them; the joints come late now and then."""
    path, draw = tmp_path_factory.mktemp("joints") / "session.mcap", np.random.default_rng(3)
    stage = Tilter.from_settings(arm_settings(RIG)).stage
    attitude, names = Attitude(stage), stage.model.joint_names
    with Recording(path, provenance=Provenance(rig_id=RIG.id, started_ns=0, rig_toml=RIG.text)) as recording:
        for number in range(1, READINGS + 1):
            angles, rates = stage.home_rad + draw.uniform(-1.0, 1.0, 6), draw.normal(size=6)
            reading = JointReading(10_000_000 * number, names, angles, rates, np.full(6, np.nan))
            state = attitude.state(reading)
            joints = JointState(
                reading.stamp_ns, tuple(names), tuple(angles.tolist()), tuple(rates.tolist()), (0.0,) * 6
            )
            messages = [("arm/joints", joints), ("arm/platform", state)]
            for topic, message in reversed(messages) if number % 7 == 0 else messages:
                recording.write_message(topic, message, receive_ns=reading.stamp_ns)
    return path


def test_the_attitudes_follow_from_the_joints(recorded: Path) -> None:
    """Two implementations: the agent's is MuJoCo's, on a chain of bodies."""
    found = attitudes_again(open_recording(recorded), placed_arm(RIG))
    print(f"\n{found.compared} of {found.attitudes} attitudes, at most {found.worst:.1e} apart")
    assert (found.attitudes, found.compared, found.different) == (READINGS, READINGS, 0)
    assert found.worst < SAME / 100


def all_shifted(state: JointState | PlatformState) -> JointState | PlatformState:
    """Every joint is two thousandths of a radian elsewhere, in the whole recording."""
    if isinstance(state, PlatformState):
        return state
    return replace(state, position_rad=tuple(angle + 2e-3 for angle in state.position_rad))


def one_attitude(state: JointState | PlatformState) -> JointState | PlatformState:
    if isinstance(state, PlatformState) and state.stamp_ns == 1_000_000_000:
        return replace(state, wy=state.wy + 1e-6)
    return state


@pytest.mark.parametrize(("change", "different"), [(all_shifted, READINGS), (one_attitude, 1)])
def test_what_was_changed_is_found(
    change: Callable[[JointState | PlatformState], JointState | PlatformState],
    different: int,
    recorded: Path,
    tmp_path: Path,
) -> None:
    def edit(items: Iterator[Item]) -> Iterable[Item]:
        for item in items:
            message = item.message
            yield item.with_message(change(message)) if isinstance(message, JointState | PlatformState) else item

    found = verify(forged(recorded, tmp_path / "forged.mcap", edit))
    part = next(part for part in found.parts if part.name == "attitudes")
    assert part.state == "different"
    assert part.sentence.endswith(f"{different} do not follow from them")
    assert not found.holds
    assert found.first is not None
    assert found.first.topic == "arm/platform"
    assert found.first.field == ("wy" if different == 1 else "qw")


def test_joints_that_are_missing_are_counted(recorded: Path, tmp_path: Path) -> None:
    def edit(items: Iterator[Item]) -> Iterable[Item]:
        return (item for item in items if item.topic == "arm/platform" or item.log_ns % 20_000_000)

    parts = verify(forged(recorded, tmp_path / "half.mcap", edit)).parts
    assert parts[2].sentence == f"{READINGS // 2} of {READINGS} follow from the joints of their moment"
