"""The arm agent with the servo driver and the emulated stage on a pty, in simulated time: what keeps it safe."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path

import pytest

pytest.importorskip("tty", reason="the emulated stage is on a pty, which Windows does not have")

from shared.bus import Received
from shared.clock import SimulatedClock
from shared.config import Table, parse
from shared.errors import UserError
from shared.geometry import tilt_of
from shared.memory_bus import MemoryBus
from shared.messages import ArmReply, ArmStop, Heartbeat, Message, MotionReport, PlatformState, TiltCommand
from shared.rig import load_rig
from station.__main__ import main as station
from station.arm.agent import arm_agent
from station.arm.drivers._servo_lines import FOLLOWING, IDLE, PER_DEGREE, line
from station.rig.arm_settings import ArmSettings
from tests.tilt_stage.emulated import EmulatedStage, Served, answering, opened

TICK_NS = 10_000_000


class Bench:
    """An arm agent, the station's side of its bus, and the stage; the cable may be cut."""

    def __init__(self, pty: Served, *, armed: bool = True) -> None:
        self.clock, self.pty, self.stage = SimulatedClock(), pty, pty.stage
        self.began_ns = self.clock.now_ns()
        self.bus = MemoryBus(self.clock)
        self.beats = self.connected = True
        options = Table({"port": pty.port, "level_by_hand": True})
        settings = ArmSettings(driver="servo", model="tilt_stage_2", armed=armed, options=options)
        with answering(pty):
            self.agent = arm_agent(self.bus, settings)
        self.reports: list[MotionReport] = []
        self.tilt_deg = 0.0
        self.bus.subscribe("arm/motion", self._report)
        self.bus.subscribe("arm/platform", self._tilt)
        self.until(lambda: self.clock.now_ns() > self.began_ns + 100_000_000)

    def _report(self, received: Received) -> None:
        assert isinstance(received.message, MotionReport)
        self.reports.append(received.message)

    def _tilt(self, received: Received) -> None:
        state = received.message
        assert isinstance(state, PlatformState)
        self.tilt_deg = math.degrees(tilt_of(state.qw, state.qx, state.qy, state.qz))

    def until(self, reached: Callable[[], bool], *, seconds: float = 20.0) -> None:
        """Lets time pass; fails when it is not so in time."""
        for _ in range(round(seconds * 1e9 / TICK_NS)):
            if reached():
                return
            self.clock.advance_to(self.clock.now_ns() + TICK_NS)
            if self.connected:
                self.pty.serve((self.clock.now_ns() - self.began_ns) // 1_000_000)
                time.sleep(0.0005)  # the kernel hands the bytes on
            if self.beats:
                self.bus.publish("session/heartbeat", Heartbeat(self.clock.now_ns(), armed=True))
            self.agent.tick(self.clock.now_ns())
        raise AssertionError(f"not reached; the stage is at {self.stage.at}, reports: {self.reports}")

    def ask(self, service: str, message: Message) -> ArmReply:
        replies: list[Message | None] = []
        self.bus.request(service, message, replies.append)
        assert isinstance(replies[0], ArmReply)
        return replies[0]

    def tilt(self, angle_deg: float, *, direction: int = 0, azimuth_deg: float = 0.0) -> ArmReply:
        angle, azimuth = math.radians(angle_deg), math.radians(azimuth_deg)
        command = TiltCommand(self.clock.now_ns(), 1, direction, azimuth, angle, 1, math.radians(20))
        return self.ask("arm/command", command)

    def angles(self) -> list[float]:
        return [angle / PER_DEGREE for angle in self.stage.at]


@contextmanager
def bench(*, armed: bool = True, stage: EmulatedStage | None = None) -> Generator[Bench]:
    with opened(stage or EmulatedStage()) as pty:
        made = Bench(pty, armed=armed)
        try:
            yield made
        finally:
            made.agent.close()


def test_the_stage_tilts_in_each_direction_and_at_any_azimuth() -> None:
    with bench() as rig:
        for tilt, direction, azimuth, axes in (
            (20, 0, 0, (20, 0)),
            (20, 1, 0, (0, 20)),
            (20, 2, 0, (-20, 0)),
            (20, 3, 0, (0, -20)),
            # R = Rx(a) Ry(b) has the wanted gravity if sin a = sin 30° cos 45° and sin b cos a = sin 30° sin 45°.
            (30, -1, 45, (20.705, 22.208)),
        ):
            for angle in (tilt, 0):
                before = len(rig.reports)
                assert rig.tilt(angle, direction=direction, azimuth_deg=azimuth).accepted
                rig.until(lambda before=before: len(rig.reports) == before + 2)
                assert rig.reports[-1].fault == ""
                assert rig.tilt_deg == pytest.approx(angle, abs=0.1)
                if angle:
                    assert rig.angles() == pytest.approx(axes, abs=0.05)


def test_the_stage_is_not_even_armed_before_a_motion_may_be() -> None:
    with bench(armed=False) as rig:
        assert "read-only" in rig.tilt(10).reason
        rig.until(lambda: rig.clock.now_ns() > rig.began_ns + 500_000_000)
        assert rig.stage.state == IDLE
        assert not rig.stage.placed
        assert rig.angles() == [0, 0]


def test_an_emergency_stop_stops_the_stage_itself() -> None:
    with bench() as rig:
        rig.tilt(40)
        rig.until(lambda: rig.tilt_deg > 10)
        rig.ask("arm/stop", ArmStop(rig.clock.now_ns(), "test"))
        here = rig.angles()
        rig.until(lambda: rig.stage.state == IDLE)
        stopped_ns = rig.clock.now_ns()
        rig.until(lambda: rig.clock.now_ns() > stopped_ns + 2_000_000_000)
        assert rig.stage.state == IDLE
        assert rig.angles() == pytest.approx(here, abs=1.0)
        assert "stopped" in rig.tilt(10).reason


def test_a_stop_whose_line_is_damaged_is_said_again() -> None:
    with bench() as rig:
        rig.tilt(40)
        rig.until(lambda: rig.tilt_deg > 10)
        rig.stage.lines.take(b"a line without an end ")  # the next bytes are a part of it
        rig.ask("arm/stop", ArmStop(rig.clock.now_ns(), "test"))
        rig.until(lambda: rig.stage.state == IDLE, seconds=0.1)


def test_without_the_station_the_agent_holds_and_levels() -> None:
    with bench() as rig:
        rig.tilt(30)
        rig.until(lambda: len(rig.reports) == 2)
        rig.beats = False
        rig.until(lambda: rig.tilt_deg < 0.1, seconds=25)


def test_a_cable_that_is_pulled_ends_the_motion_and_the_stage_levels() -> None:
    with bench() as rig:
        rig.tilt(40)
        rig.until(lambda: rig.tilt_deg > 10)
        rig.connected = False
        rig.until(lambda: bool(rig.reports[-1].fault))
        assert "no longer reports its joints" in rig.reports[-1].fault
        rig.stage.advance(rig.stage.now_ms + 30_000)
        assert rig.angles() == [0, 0]


def test_the_stop_button_ends_the_motion() -> None:
    with bench() as rig:
        rig.tilt(40)
        rig.until(lambda: rig.tilt_deg > 10)
        rig.stage.pressed = True
        rig.until(lambda: bool(rig.reports[-1].fault))
        assert "it is stopped" in rig.reports[-1].fault
        assert "does not follow" in rig.reports[-1].fault
        rig.stage.pressed = False
        assert rig.tilt(0).accepted
        rig.until(lambda: rig.tilt_deg < 0.1)


def test_a_busy_machine_while_nothing_moves_costs_nothing() -> None:
    with bench() as rig:
        rig.tilt(20)
        rig.until(lambda: len(rig.reports) == 2)
        now_ms = rig.stage.now_ms
        rig.stage.advance(now_ms + 1000)  # it holds already
        rig.began_ns -= 1_000_000_000
        rig.until(lambda: rig.stage.state == FOLLOWING)
        assert rig.angles() == pytest.approx([20, 0], abs=0.05)
        assert rig.tilt(25).accepted
        rig.until(lambda: len(rig.reports) == 4)
        assert rig.reports[-1].fault == ""


@pytest.mark.parametrize(("frozen_s", "there_deg"), [(9, 19.5), (30, 0.0)])
def test_after_a_freeze_in_which_the_stage_has_levelled_it_goes_on_from_where_it_stands(
    frozen_s: int, there_deg: float
) -> None:
    with bench() as rig:
        rig.tilt(30)
        rig.until(lambda: len(rig.reports) == 2)
        woke_ns = rig.clock.now_ns() + frozen_s * 1_000_000_000
        rig.clock.advance_to(woke_ns)  # nobody ticks, nobody hears
        rig.until(lambda: rig.clock.now_ns() > woke_ns + 100_000_000)
        assert rig.stage.state == IDLE
        assert rig.angles()[0] == pytest.approx(there_deg, abs=0.5)
        before = len(rig.reports)
        assert rig.tilt(35).accepted
        rig.until(lambda: len(rig.reports) == before + 2)
        assert rig.reports[-1].fault == ""
        assert rig.tilt_deg == pytest.approx(35, abs=0.1)


class Thrown(EmulatedStage):
    """A stage whose plate stays where it was when its board starts anew, and is thrown to where that believes it is."""

    stood: list[int] | None = None
    thrown = False

    def restart(self) -> None:
        self.stood = list(self.at)
        super().restart()

    def move(self) -> None:
        super().move()
        self.thrown = self.thrown or (self.stood is not None and self.state == FOLLOWING and self.at != self.stood)


def seconds(rig: Bench, seconds: float) -> None:
    end_ns = rig.clock.now_ns() + round(seconds * 1e9)
    rig.until(lambda: rig.clock.now_ns() >= end_ns, seconds=seconds + 1)


@pytest.mark.parametrize("names", [True, False])
@pytest.mark.parametrize("moving", [True, False])
def test_a_board_that_starts_anew_throws_no_plate(names: bool, moving: bool) -> None:
    with bench(stage=Thrown(names=names)) as rig:
        assert isinstance(rig.stage, Thrown)
        rig.tilt(30)
        rig.until((lambda: rig.tilt_deg > 15) if moving else (lambda: len(rig.reports) == 2))
        rig.stage.restart()
        for _ in range(3):
            seconds(rig, 0.5)
            reply = rig.tilt(20)
            assert not reply.accepted
            assert "started anew" in reply.reason
            assert "put it level by hand" in reply.reason
        rig.beats = False
        seconds(rig, 10)
        assert not rig.stage.thrown


def test_a_board_that_starts_anew_and_measures_its_angles_goes_on() -> None:
    class Measuring(EmulatedStage):
        def restart(self) -> None:
            at = list(self.at)
            super().restart()
            self.at, self.goal, self.placed = at, list(at), True

    with bench(stage=Measuring(placed=True)) as rig:
        rig.tilt(30)
        rig.until(lambda: len(rig.reports) == 2)
        rig.stage.restart()
        seconds(rig, 0.5)
        assert rig.tilt(20).accepted
        rig.until(lambda: len(rig.reports) == 4)
        assert rig.reports[-1].fault == ""
        assert rig.tilt_deg == pytest.approx(20, abs=0.1)


def test_the_next_agent_goes_on_with_a_board_that_has_lived_on() -> None:
    with bench() as rig:
        rig.tilt(20)
        rig.until(lambda: len(rig.reports) == 2)
        rig.agent.close()
        rig.stage.now_ms = rig.stage.heard_ms = 0  # the next bench's time begins anew
        again = Bench(rig.pty)
        assert again.tilt(0).accepted
        again.until(lambda: len(again.reports) == 2)
        assert again.reports[-1].fault == ""


def test_a_life_is_armed_by_its_name_alone() -> None:
    """The word to arm may reach a board that has just started anew."""
    stage = EmulatedStage()
    stage.hear(line("?", 7))
    stage.hear(line("A", 7))
    assert stage.state == FOLLOWING
    stage.restart()
    stage.hear(line("A", 7))
    assert stage.state == IDLE
    stage.hear(line("?") + line("A"))  # a driver from before lives had names
    assert stage.state == FOLLOWING


def test_a_rig_file_for_a_stage_lies_beside_the_sketch_and_is_one() -> None:
    rig = load_rig(Path(__file__).parents[2] / "deploy" / "tilt_stage" / "rig.toml")
    settings = parse(ArmSettings, rig.arm)
    assert not settings.may_arm
    with opened(EmulatedStage()) as pty, answering(pty):
        there = Table({**settings.options.values, "port": pty.port, "level_by_hand": True})
        arm_agent(MemoryBus(SimulatedClock()), replace(settings, options=there)).close()


def test_other_poses_of_a_stage_are_not_searched_for(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--model", "tilt_stage_2", "--every-deg", "90", "--search", "--picture", str(tmp_path / "plan.png")]
    assert station(["arm", "plan", *words]) == 2
    assert "tilt_stage_2 is a stage and has one pose" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("stage", "options", "said"),
    [
        (EmulatedStage(), {}, "level_by_hand = true"),
        (EmulatedStage(axes=1), {}, "Expected a stage of 2 axes"),
        (EmulatedStage(limit=30 * PER_DEGREE, placed=True), {}, "limits of stage_x within the stage's own -30 to 30"),
        (None, {"answer_timeout_s": 0.1}, "nothing there answers as one"),
        (None, {"port": "/dev/no-such-port"}, "cannot be opened"),
        (None, {"colour": 3}, "colour"),
    ],
)
def test_a_stage_that_does_not_fit_is_refused_in_words(
    stage: EmulatedStage | None, options: dict[str, object], said: str
) -> None:
    with opened(stage or EmulatedStage()) as pty, answering(pty) if stage else nullcontext():
        settings = ArmSettings(driver="servo", model="tilt_stage_2", options=Table({"port": pty.port, **options}))
        with pytest.raises(UserError, match=said):
            arm_agent(MemoryBus(SimulatedClock()), settings)
