"""A named person hears what a session does: from the real state machine, and through `station run`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from shared.bus import Received
from shared.clock import SimulatedClock
from shared.memory_bus import MemoryBus
from shared.messages import MarkerCorners
from shared.notify import NotifyConfig
from station.__main__ import main
from station.app import assembly
from station.app.attached import attached_rig
from station.app.notify.watch import Watch
from station.recording.reader import open_recording
from station.sampling.plan import Plan
from tests.unit.notify.receiver import SECRET, receiver
from tests.unit.sampling.scripted_rig import ScriptedRig


class Told:
    """Takes what would be sent."""

    def __init__(self) -> None:
        self.all: list[tuple[str, str]] = []

    def tell(self, kind: str, text: str, *, wanted: bool | None = None, **_: Any) -> None:
        if wanted is not False:
            self.all.append((kind, text))

    def failures(self) -> tuple[str, ...]:
        return ("its url answered with status 500",) if self.all else ()


def watched(rig: ScriptedRig, *, on: tuple[str, ...] = ("fault", "end")) -> tuple[Watch, Told, list[str]]:
    """A watch over a scripted rig: its messages and events go over a bus as well."""
    told, failures = Told(), list[str]()
    clock, config = SimulatedClock(start_ns=rig.now_ns), NotifyConfig(url="http://x", on=on)  # pyright: ignore[reportArgumentType]
    watch = Watch(told, config, rig_id="lab", recording="a.mcap", planned=9, now=lambda: rig.now_ns)  # pyright: ignore[reportArgumentType]
    bus = MemoryBus(clock)
    watch.attach(bus, rig.machine, on_failure=failures.append)
    events = rig.events
    handle = rig.machine.handle

    def hear(message: Any, *, now_ns: int) -> Any:
        actions = handle(message, now_ns=now_ns)
        clock.advance_to(now_ns)
        if isinstance(message, MarkerCorners):
            bus.publish("camera/corners", message)
        for action in actions:
            if getattr(getattr(action, "message", None), "phase", ""):
                bus.publish("session/event", action.message)  # pyright: ignore[reportAttributeAccessIssue]
        watch.tick(now_ns)
        return actions

    rig.machine.handle = hear
    assert events == []
    return watch, told, failures


def test_a_mark_that_is_lost_and_the_faults_that_come_of_it_are_told():
    def lost(corners: MarkerCorners, rig: ScriptedRig) -> MarkerCorners:
        return corners if rig.now_ns < 5_000_000_000 else replace(corners, found=False, reason="no dark square")

    rig = ScriptedRig(Plan(samples=9), on_corners=lost)
    watch, told, failures = watched(rig)
    rig.run(200)
    assert rig.fault
    watch.ended(rig.fault, samples=rig.machine.samples)
    kinds = [kind for kind, _ in told.all]
    assert kinds.count("mark") == 1
    assert "has not seen the mark for 10 s (no dark square)" in dict(told.all)["mark"]
    assert 1 <= kinds.count("fault") < Plan().faults, "the last one is told by the end"
    assert kinds[-1] == "end"
    assert "the session ended early: 5 runs failed in a row" in told.all[-1][1]
    assert failures[0] == "its url answered with status 500"


def test_an_outage_is_told_when_it_is_long_and_is_no_fault():
    rig = ScriptedRig(Plan(samples=9))
    _, told, _ = watched(rig)
    rig.run(60, until=lambda rig: rig.phases()[-1:] == ["TILT"])
    rig.arm_away = True
    rig.run(59)
    assert told.all == []
    rig.run(10)
    ((kind, text),) = told.all
    assert kind == "outage"
    assert "the session has waited for 60 s; no answer" in text


def test_who_wants_to_hear_of_faults_alone_hears_of_an_end_by_a_fault():
    rig = ScriptedRig(Plan(samples=9))
    watch, told, _ = watched(rig, on=("fault",))
    watch.ended("", samples=9)
    assert told.all == []
    watch.ended("the recording stopped", samples=3)
    assert told.all == [("end", "Rig lab: the session ended early: the recording stopped (3 of 9 samples, a.mcap)")]


def test_a_full_disk_and_an_error_of_the_program_are_told():
    rig = ScriptedRig(Plan(samples=9))
    watch, told, _ = watched(rig)
    watch.stopped_recording("The recording stopped because the disk is full")
    watch.broke_off(RuntimeError(SECRET))
    watch.broke_off(RuntimeError("again"))
    assert [kind for kind, _ in told.all] == ["disk", "end"]
    assert "the program met an error (RuntimeError)" in told.all[1][1]


def test_a_session_tells_its_end_and_its_recording_not_whom(tmp_path: Path, capfd: pytest.CaptureFixture[str]):
    rig, path = tmp_path / "rig.toml", tmp_path / "a.mcap"
    with receiver() as got:
        rig.write_text(
            assembly.simulated_rig_path().read_text(encoding="utf-8") + f'\n[notify]\nurl = "{got.url}"\n',
            encoding="utf-8",
        )
        assert main(["notify", "--rig", str(rig)]) == 0
        assert main(["run", "--lockstep", "--rig", str(rig), "--samples", "1", "--out", str(path)]) == 0
    trial, end = got.came
    assert trial["trial"]
    assert end == {
        **{"event": "end", "rig": "simulated", "recording": "a.mcap", "samples": 1, "planned": 1, "fault": ""},
        **{"text": "Rig simulated: the session is over (1 of 1 samples, a.mcap)", "time": end["time"]},
    }
    recorded = path.read_bytes()
    assert SECRET.encode() not in recorded
    attached = open_recording(path).attachments["rig.toml"].decode()
    assert SECRET not in attached
    assert "[notify] stood here" in attached
    inside = attached_rig(open_recording(path))
    assert inside is not None
    assert not inside.notify.anybody
    assert SECRET not in "".join(capfd.readouterr())


def test_a_receiver_that_is_gone_does_not_end_a_session_and_is_named(tmp_path: Path, capfd: pytest.CaptureFixture[str]):
    rig = tmp_path / "rig.toml"
    text = assembly.simulated_rig_path().read_text(encoding="utf-8")
    rig.write_text(text + '\n[notify]\ncommand = ["no-such-program"]\n', encoding="utf-8")
    assert main(["notify", "--rig", str(rig)]) == 1
    assert "cannot be started" in capfd.readouterr().out
    assert main(["notify", "--rig", str(assembly.simulated_rig_path())]) == 2
    assert "nobody would be told" in capfd.readouterr().err


def test_a_message_of_another_kind_is_passed_over():
    watch, told, _ = watched(ScriptedRig(Plan(samples=9)))
    for handler in (watch._on_corners, watch._on_event):  # pyright: ignore[reportPrivateUsage]
        handler(Received("log", 1, MarkerCorners(found=True)))
    assert told.all == []
