"""The procedure without arm and sensors: stops, waiting, and what ends it."""

from __future__ import annotations

import math

import pytest

from shared.messages import ArmReply, MotionReport, RunEvent, TiltCommand
from station.angles.plan import ComparisonPlan, planned_stops
from station.angles.procedure import Output, Phase, Procedure
from station.angles.settings import SourceName
from station.angles.watch import Note

STEP_NS = 10_000_000
QUICK = ComparisonPlan(to_deg=2.0, step_deg=1.0, sweeps=2, readings=5, settle_s=0.1)
IMU, GAUGE = SourceName("imu", "mavlink"), SourceName("gauge", "typed", on_demand=True)


class Rig:
    """An arm that obeys at once, and sensors that read at every step unless they are `mute`."""

    def __init__(self, plan: ComparisonPlan, *sources: SourceName) -> None:
        self.procedure = Procedure(plan, sources=sources)
        self.sources = sources
        self.now_ns = 1_000_000_000
        self.outputs: list[Output] = []
        self.mute: set[str] = set()
        self.reply: ArmReply | None = ArmReply(accepted=True)
        self.fault = ""
        self.ends = True

    def run(self, seconds: float = 1000.0) -> None:
        end_ns = self.now_ns + round(seconds * 1e9)
        while self.procedure.phase not in (Phase.DONE, Phase.FAILED) and self.now_ns < end_ns:
            self.step()

    def step(self) -> None:
        self.now_ns += STEP_NS
        for source in self.sources:
            if source.name not in self.mute and not source.on_demand:
                self.procedure.on_reading(source.name, stamp_ns=self.now_ns)
        self.procedure.tick(self.now_ns)
        for output in self.procedure.take_outputs():
            self.outputs.append(output)
            if isinstance(output, TiltCommand):
                self._obey(output)
            elif isinstance(output, RunEvent) and output.phase == "DWELL" and "gauge" not in self.mute:
                self.procedure.on_reading("gauge", stamp_ns=self.now_ns + 1)

    def _obey(self, command: TiltCommand) -> None:
        self.procedure.on_reply(self.reply, now_ns=self.now_ns)
        end_ns = self.now_ns if self.ends else 0
        report = MotionReport(self.now_ns, command.run, command.step, self.now_ns, end_ns, self.fault)
        self.procedure.on_motion(report, now_ns=self.now_ns)

    def commanded_deg(self) -> list[float]:
        return [round(math.degrees(o.angle_rad), 6) for o in self.outputs if isinstance(o, TiltCommand)]

    def said(self) -> list[str]:
        return [output.text for output in self.outputs if isinstance(output, Note)]


def test_the_papers_stops() -> None:
    stops = planned_stops(ComparisonPlan())
    assert len(stops) == 5 * 20 + 1
    degrees = [round(math.degrees(stop.angle_rad), 9) for stop in stops]
    assert degrees[:20] == [*range(11), *range(9, 0, -1)]
    assert degrees[20] == degrees[-1] == 0
    assert len({(stop.sweep, stop.step) for stop in stops}) == len(stops)


def test_stops_without_a_way_back_end_at_level_all_the_same() -> None:
    rig = Rig(ComparisonPlan(to_deg=1.0, sweeps=2, readings=1, way_back=False), IMU)
    rig.run()
    assert rig.commanded_deg() == [0, 1, 0, 1, 0]
    assert rig.procedure.phase is Phase.DONE


def test_a_step_that_does_not_divide_the_tilt_stays_below_it() -> None:
    degrees = {round(math.degrees(s.angle_rad), 6) for s in planned_stops(ComparisonPlan(to_deg=10.0, step_deg=3.0))}
    assert degrees == {0, 3, 6, 9}


@pytest.mark.parametrize("wrong", [{"to_deg": 0.0}, {"sweeps": 0}, {"step_deg": 20.0}, {"to_deg": math.nan}])
def test_a_plan_that_cannot_be_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="expected"):
        ComparisonPlan(**wrong)  # pyright: ignore[reportArgumentType]


def test_every_stop_is_commanded_reached_rested_at_and_read() -> None:
    rig = Rig(QUICK, IMU, GAUGE)
    rig.run()
    assert rig.procedure.phase is Phase.DONE
    assert rig.commanded_deg() == [0, 1, 2, 1, 0, 1, 2, 1, 0]
    events = [output for output in rig.outputs if isinstance(output, RunEvent)]
    assert [event.phase for event in events] == ["DWELL", "DONE"] * 9
    windows = [(end.stamp_ns - begin.stamp_ns) for begin, end in zip(events[::2], events[1::2], strict=True)]
    assert min(windows) >= 4 * STEP_NS  # five readings fit in
    commands = [output for output in rig.outputs if isinstance(output, TiltCommand)]
    rests = [begin.stamp_ns - command.stamp_ns for begin, command in zip(events[::2], commands, strict=True)]
    assert min(rests) >= 0.1e9


def test_a_source_that_falls_silent_holds_up_each_stop_for_its_patience_only() -> None:
    rig = Rig(QUICK, IMU, SourceName("natnet", "natnet"))
    rig.run(seconds=1.0)
    rig.mute.add("natnet")
    began_ns = rig.now_ns
    rig.run()
    assert rig.procedure.phase is Phase.DONE
    assert rig.now_ns - began_ns < 9 * (QUICK.patience_s + 1.0) * 1e9
    assert any("Nothing from natnet" in text for text in rig.said())


def test_a_source_that_never_speaks_is_named_before_the_first_stop() -> None:
    rig = Rig(QUICK, IMU, SourceName("natnet", "natnet"))
    rig.mute.add("natnet")
    rig.run()
    assert rig.procedure.phase is Phase.DONE
    assert rig.said()[0] == "The comparison begins without natnet: no reading in 10 s."


def test_without_any_source_nothing_moves() -> None:
    rig = Rig(QUICK, IMU)
    rig.mute.add("imu")
    rig.run()
    assert rig.procedure.phase is Phase.FAILED
    assert "imu" in rig.procedure.failure
    assert rig.commanded_deg() == []


def test_a_person_is_waited_for() -> None:
    rig = Rig(QUICK, IMU, GAUGE)
    rig.mute.add("gauge")
    rig.run(seconds=60.0)
    assert rig.procedure.phase is Phase.READING
    rig.procedure.on_reading("gauge", stamp_ns=rig.now_ns)
    rig.step()
    assert rig.procedure.phase is not Phase.READING


def test_an_arm_that_does_not_answer_refuses_or_stops_ends_it_with_a_sentence() -> None:
    for reply, fault, said in (
        (None, "", "did not answer"),
        (ArmReply(reason="The arm is read-only."), "", "The arm refused to move: The arm is read-only."),
        (ArmReply(accepted=True), "joint_2 is 3.0 degrees off", "sweep 1, stop 1: joint_2 is 3.0 degrees off"),
    ):
        rig = Rig(QUICK, IMU)
        rig.reply, rig.fault = reply, fault
        rig.run()
        assert rig.procedure.phase is Phase.FAILED
        assert said in rig.procedure.failure


def test_an_arm_that_never_arrives_ends_it() -> None:
    rig = Rig(QUICK, IMU)
    rig.ends = False
    rig.run()
    assert rig.procedure.phase is Phase.FAILED
    assert "did not report the end of its motion" in rig.procedure.failure


def test_the_end_of_another_motion_is_not_taken_for_ours() -> None:
    rig = Rig(QUICK, IMU)
    rig.ends = False
    rig.run(seconds=1.0)
    assert rig.procedure.phase is Phase.MOVING
    rig.procedure.on_motion(MotionReport(rig.now_ns, 9, 9, 1, 2, ""), now_ns=rig.now_ns)
    assert rig.procedure.phase is Phase.MOVING
