"""A halted arm stands where it came to rest, not where its plan was: whoever moves it next begins there."""

from __future__ import annotations

import numpy as np
import pytest

from shared.foxglove import Log
from station.arm.drivers.simulated import SimulatedArm
from station.rig.arm_settings import ArmSettings, GateSettings
from tests.unit.arm.conftest import FakeRig, tilt_deg

BRAKING_NS = 300_000_000


class BrakingArm(SimulatedArm):
    """An arm that takes the next part of its motion to brake, which nobody is told."""

    def halt(self, *, now_ns: int) -> None:
        super().halt(now_ns=now_ns + BRAKING_NS)


def lines(rig: FakeRig) -> list[str]:
    return [line.message for line in rig.of(Log) if isinstance(line, Log)]


class Jammed(FakeRig):
    """An arm that a protective stop of its own has halted in mid tilt; `free` ends that."""

    def __init__(self) -> None:
        super().__init__(ArmSettings())
        self.advance(0.2)
        assert self.command(30).accepted
        self.advance(2.0)
        frozen = np.array(self.position)
        self.disturb = lambda joints: frozen  # noqa: ARG005
        self.rest(2.0)
        assert "from where it should be" in self.reports[-1].fault

    def rest(self, seconds: float, *, heartbeat: bool = True) -> None:
        """Lets time pass in which the arm does not move."""
        for _ in range(round(seconds * 100)):
            self.velocity = (0.0,) * len(self.names)
            self.advance(0.01, heartbeat=heartbeat)

    def free(self) -> None:
        """Lets the arm obey again, from where it is held."""
        self.position = tuple(self.disturb(np.array(self.position)).tolist())
        self.disturb = lambda joints: joints


def test_an_arm_that_stopped_by_itself_is_levelled_by_a_command() -> None:
    rig = Jammed()
    rig.free()
    held = np.array(rig.position)
    reply = rig.command(0)
    assert reply.accepted, reply.reason
    rig.advance(0.02)
    np.testing.assert_allclose(rig.position, held, rtol=0, atol=2e-3)
    rig.advance(6)
    assert tilt_deg(rig) == pytest.approx(0, abs=1e-3)


def test_an_arm_that_stopped_by_itself_is_levelled_when_the_station_is_gone() -> None:
    rig = Jammed()
    rig.free()
    rig.advance(30, heartbeat=False)
    assert tilt_deg(rig) == pytest.approx(0, abs=1e-3)


def test_an_arm_that_stays_jammed_is_tried_again_now_and_then_and_levelled_once_it_is_free() -> None:
    rig = Jammed()
    before = len(lines(rig))
    rig.rest(60, heartbeat=False)
    assert len(lines(rig)) - before <= 10
    rig.free()
    rig.advance(30, heartbeat=False)
    assert tilt_deg(rig) == pytest.approx(0, abs=1e-3)


def test_an_agent_that_is_started_in_mid_tilt_levels_when_the_station_is_gone() -> None:
    tilted = Jammed()
    rig = FakeRig(ArmSettings())
    rig.position = tuple(tilted.disturb(np.array(tilted.position)).tolist())
    rig.advance(0.2)
    rig.advance(30, heartbeat=False)
    assert tilt_deg(rig) == pytest.approx(0, abs=1e-3)


@pytest.mark.parametrize("direction", [0, 1])
def test_an_arm_that_brakes_goes_on_from_where_it_rests(monkeypatch: pytest.MonkeyPatch, direction: int) -> None:
    """It rests 6 degrees further than its plan was at the stop."""
    monkeypatch.setattr("station.arm.drivers.simulated.SimulatedArm", BrakingArm)
    rig = FakeRig(ArmSettings())
    rig.advance(0.2)
    rig.command(40, direction=direction, rate_deg_s=20.0)
    rig.advance(1.0)
    rig.stop("operator")
    rig.advance(0.5)
    rests = rig.position
    rig.advance(0.2, armed=False)
    rig.advance(0.2)
    reply = rig.command(40, direction=direction)
    assert reply.accepted, reply.reason
    rig.advance(0.02)
    np.testing.assert_allclose(rig.position, rests, rtol=0, atol=1e-4)


def test_a_halted_arm_that_still_moves_is_not_located() -> None:
    rig = Jammed()
    rig.velocity = (0.1,) * len(rig.names)
    rig.advance(0.01)
    assert "moves by itself" in rig.command(0).reason


def test_a_plate_that_could_not_be_levelled_in_time_is_refused_where_the_rate_is_read() -> None:
    with pytest.raises(ValueError, match=r"at least 0\.12 degrees/s for 'level_rate_deg_s'"):
        GateSettings(level_rate_deg_s=0.05)
    slowest = GateSettings(level_rate_deg_s=0.12)
    rig = FakeRig(ArmSettings(gate=slowest))
    rig.advance(0.2)
    assert rig.command(67, rate_deg_s=20.0).accepted
    rig.advance(5)
    rig.advance(8, heartbeat=False)
    assert "levelling slowly" in " ".join(lines(rig))
    assert rig.reports[-1].fault == ""


def test_a_levelling_that_cannot_be_planned_is_said_and_ends_no_agent() -> None:
    rig = FakeRig(ArmSettings())
    rig.advance(0.2)
    rig.command(40)
    rig.advance(5)
    object.__setattr__(rig.agent._motions._settings.gate, "level_rate_deg_s", 0.01)  # pyright: ignore[reportPrivateUsage]
    rig.advance(30, heartbeat=False)
    assert len([line for line in lines(rig) if "Expected a tilt that ends within" in line]) == 1
