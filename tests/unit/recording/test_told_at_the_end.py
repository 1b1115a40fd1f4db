"""A recording that cannot be finished is no success: whoever asked for it is told, however late it fails."""

from __future__ import annotations

import errno
from pathlib import Path

import pytest

from shared.clock import SystemClock
from shared.errors import UserError
from shared.memory_bus import MemoryBus
from station.__main__ import main
from station.app import assembly
from station.app.live import LiveSession
from station.app.processes import StopRequest
from station.recording import names
from station.recording.importers import Imported, write
from station.recording.recorder import Recorder
from station.recording.writer import Recording, partial_path
from station.recording.writer_process import WriterProcess, can_start_writer_process
from tests.unit.recording import session

BROKE_OFF = "The recording broke off"


@pytest.fixture(autouse=True)
def _nothing_gets_its_name(monkeypatch: pytest.MonkeyPatch) -> None:
    def give(_names: names.Names, _unfinished: Path, _path: Path) -> Path:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(names.Names, "give", give)


def opened(path: Path) -> Recording:
    return Recording(path, provenance=session.provenance())


def test_the_recorder_tells_it(tmp_path: Path) -> None:
    clock, told = SystemClock(), list[str]()
    bus = MemoryBus(clock)
    recorder = Recorder(bus, opened(tmp_path / "a.mcap"), clock=clock, on_stopped=told.append)
    for _, topic, message in session.traffic():
        bus.publish(topic, message)
    recorder.close()
    (sentence,) = told
    assert sentence.startswith(BROKE_OFF)
    assert str(partial_path(tmp_path / "a.mcap")) in sentence


def test_a_live_session_has_failed(tmp_path: Path) -> None:
    clock = SystemClock()
    rig = assembly.rig_from(None)
    stop = StopRequest(reason="stopped by the user")
    live = LiveSession(
        MemoryBus(clock),
        rig,
        assembly.plan_from(None, samples=1, seed=1),
        recording=opened(tmp_path / "a.mcap"),
        clock=clock,
        stop=stop,
        on_line=lambda _level, _text: None,
    )
    assert f"stopped by the user; {BROKE_OFF}" in live.run()


apart_too = pytest.mark.skipif(not can_start_writer_process(), reason="needs Linux and two processors")


@apart_too
def test_the_process_that_writes_tells_it(tmp_path: Path) -> None:
    sink = WriterProcess(opened(tmp_path / "a.mcap"))
    sink.close()
    assert sink.stopped.startswith(BROKE_OFF)


@pytest.mark.parametrize("apart", [False, pytest.param(True, marks=apart_too)])
def test_a_block_that_ends_in_order_raises_it(tmp_path: Path, *, apart: bool) -> None:
    recording = opened(tmp_path / "a.mcap")
    with pytest.raises(UserError, match=BROKE_OFF), WriterProcess(recording) if apart else recording:
        pass
    recording = opened(tmp_path / "b.mcap")
    with pytest.raises(KeyboardInterrupt), WriterProcess(recording) if apart else recording:
        raise KeyboardInterrupt


def test_an_import_fails(tmp_path: Path) -> None:
    """It said how many messages it had written."""
    items = ((topic, receive_ns, message) for receive_ns, topic, message in session.traffic())
    with pytest.raises(UserError, match=BROKE_OFF):
        write(Imported(provenance=session.provenance(), messages=items), tmp_path / "a.mcap")


@pytest.mark.parametrize(
    "words",
    [
        ("run", "--lockstep", "--samples", "1", "--out"),
        ("compare-angles", "--lockstep", "--sweeps", "1", "--to-deg", "1", "--readings", "2", "--out"),
    ],
)
def test_a_simulated_session_has_failed(
    words: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*words, str(tmp_path / "a.mcap")]) != 0
    assert BROKE_OFF in "".join(capsys.readouterr())


def test_metadata_that_finds_no_room_are_told_as_well(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    recording = opened(tmp_path / "a.mcap")

    def no_room(_name: str, _values: dict[str, str]) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(recording._file, "add_metadata", no_room)  # pyright: ignore[reportPrivateUsage]
    recording.add_metadata("recorder", {"recorded": "7"})
    assert recording.stopped.startswith(BROKE_OFF)
