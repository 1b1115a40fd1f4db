"""An emergency stop outlives the arm agent, and ends with the next session; who claimed the arm is known ever after."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from unittest.mock import ANY

import pytest

from shared.errors import UserError
from shared.foxglove import Log
from shared.messages import ArmLease
from station.arm.kept import Kept, KeptText, kept
from station.rig.arm_settings import ArmSettings
from tests.unit.arm.conftest import FakeRig


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Returns the file of a stop."""
    return tmp_path / "repose" / "rig.stopped"


def kept_at(path: Path) -> Kept:
    return Kept.at(path.with_suffix(""))


def agent(path: Path) -> FakeRig:
    return FakeRig(ArmSettings(), kept=kept_at(path))


@pytest.fixture
def killed(path: Path) -> Path:
    """The place of the stop of an agent that was killed, with the plate at rest, while the session "mine" went on."""
    first = agent(path)
    assert first.claim("mine").accepted
    first.advance(0.2, owner="mine")
    assert first.stop("a hand in the rig").accepted
    return path


def test_an_agent_that_is_started_again_does_not_obey_the_session_that_was_stopped(killed: Path) -> None:
    second = agent(killed)
    second.advance(2.0, owner="mine")
    assert "stopped (a hand in the rig)" in second.command(20, owner="mine").reason
    second.advance(2.0, owner="mine")
    assert not second.reports
    assert second.of(ArmLease)[-1] == ArmLease(ANY, "mine", "a hand in the rig")


def test_an_agent_that_is_started_again_obeys_the_next_session(killed: Path) -> None:
    second = agent(killed)
    second.advance(0.2, owner="mine")
    second.advance(0.2, owner="mine", armed=False)
    assert second.claim("theirs").accepted
    second.advance(0.2, owner="theirs")
    assert second.command(20, owner="theirs").accepted
    third = agent(killed)
    third.advance(0.2, owner="theirs")
    assert third.command(20, owner="theirs").accepted, "a stop that was lifted is not kept"


def test_an_agent_that_was_not_stopped_leaves_nothing(path: Path) -> None:
    rig = agent(path)
    rig.advance(0.2, owner="mine")
    assert not path.parent.exists()
    assert rig.claim("mine").accepted
    rig.advance(0.2, owner="mine")
    assert [one.name for one in path.parent.iterdir()] == ["rig.claimed"]


@pytest.mark.parametrize("theirs_ends", [False, True])
def test_a_session_that_was_taken_over_does_not_get_the_arm_from_the_next_agent(path: Path, theirs_ends: bool) -> None:
    """It was stopped itself meanwhile; a new agent heard its heartbeat alone, and obeyed it."""
    first = agent(path)
    assert first.claim("mine").accepted
    first.advance(0.2, owner="mine")
    assert first.claim("theirs", take_over=True).accepted
    first.advance(0.2, owner="theirs", armed=not theirs_ends)
    second = agent(path)
    second.clock.advance_to(first.clock.now_ns())
    second.advance(2.0, owner="mine")
    assert "has lost the arm to session theirs" in second.command(20, owner="mine").reason
    second.advance(0.2, owner="theirs")
    assert second.command(20, owner="theirs").accepted


def test_a_stop_that_cannot_be_kept_holds_all_the_same_and_that_is_said_once(path: Path) -> None:
    path.parent.write_text("no folder")
    rig = FakeRig(ArmSettings(), kept=_unkept(path))
    rig.advance(0.2)
    assert rig.stop("by hand").accepted
    rig.advance(1.0)
    assert "stopped (by hand)" in rig.command(20).reason
    said = [line.message for line in rig.of(Log) if isinstance(line, Log) and "will not know" in line.message]
    assert len(said) == 1


def test_a_stop_that_could_not_be_kept_is_kept_once_there_is_room(path: Path) -> None:
    path.parent.write_text("a full disk")
    rig = FakeRig(ArmSettings(), kept=_unkept(path))
    rig.advance(0.2)
    rig.stop("by hand")
    rig.advance(0.2)
    path.parent.unlink()
    rig.advance(0.02)
    assert kept_at(path).stop.read() == "by hand"


class _Unread(KeptText):
    def read(self) -> str:
        return ""


def _unkept(path: Path) -> Kept:
    return Kept(_Unread(path, what="", cut_off=""), _Unread(path.with_suffix(".claimed"), what="", cut_off=""))


@pytest.mark.skipif(sys.platform == "win32", reason="opens no folder to wait for its names")
def test_a_stop_is_on_the_disk_itself_with_its_name(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A power cut forgot what was with the kernel alone: the text, the file's name, and that of a new folder."""
    synced: dict[int, int] = {}

    def fsync(descriptor: int) -> None:
        state = os.fstat(descriptor)
        synced[state.st_ino] = state.st_size

    monkeypatch.setattr(os, "fsync", fsync)
    kept_at(path).stop.keep("by hand")
    assert synced[path.stat().st_ino] == len("by hand")
    assert {path.parent.stat().st_ino, path.parent.parent.stat().st_ino} < set(synced)


def test_what_cannot_be_read_lets_no_agent_start(path: Path) -> None:
    path.mkdir(parents=True)
    with pytest.raises(UserError, match="whether an emergency stop is in force"):
        kept_at(path).stop.read()


def test_a_file_that_was_cut_off_is_a_stop(path: Path) -> None:
    path.parent.mkdir()
    path.touch()
    assert kept_at(path).stop.read() == "emergency stop"


def test_each_rig_has_a_place_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    kept("one").stop.keep("by hand")
    assert (kept("one").stop.read(), kept("two").stop.read()) == ("by hand", "")
