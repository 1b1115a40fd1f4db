"""The replay law: over a recording the state machine takes the decisions that it took."""

import dataclasses
from collections.abc import Iterator
from pathlib import Path

import pytest

from shared.messages import Message, RunEvent, Sample, TiltCommand
from station.__main__ import main
from station.app.recorded_machine import machine_of
from station.recording.reader import open_recording
from station.sampling.machine import INPUTS
from station.sampling.replay import DECISIONS, Verdict, first_of, replay
from tests.unit.app.forging import forged

SESSION = Path(__file__).parent / "session.mcap"
Item = tuple[str, Message, int]


def stream(path: Path = SESSION) -> list[Item]:
    items = open_recording(path).messages({*INPUTS, *DECISIONS})
    return [(item.topic, item.message, item.log_ns) for item in items]


def verdict(items: list[Item], seed: int | None = None) -> Verdict:
    """The decisions of all topics, and the first that differs."""
    verdicts = replay(machine_of(open_recording(SESSION), seed=seed), items)
    return Verdict(sum(one.decisions for one in verdicts.values()), first_of(verdicts))


def test_the_golden_session_is_decided_as_it_was():
    found = verdict(stream())
    assert found.difference is None, str(found.difference)
    assert found.decisions > 100


def test_the_command_says_so(capsys: pytest.CaptureFixture[str]):
    assert main(["check", str(SESSION)]) == 0
    assert "decisions are the same" in capsys.readouterr().out


def changed(items: list[Item], kind: type[Message], **values: object) -> Iterator[Item]:
    """The stream with one field of the last message of a kind changed."""
    last = max(k for k, (_, message, _) in enumerate(items) if isinstance(message, kind))
    for k, (topic, message, now_ns) in enumerate(items):
        yield topic, dataclasses.replace(message, **values) if k == last else message, now_ns  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(
    ("kind", "values", "named"),
    [
        (TiltCommand, {"angle_rad": 0.123}, "angle_rad 0.123"),
        (RunEvent, {"phase": "TILT"}, "phase 'TILT'"),
        (Sample, {"onset_angle_rad": 0.3}, "onset_angle_rad 0.3"),
    ],
)
def test_a_recording_that_was_tampered_with_is_found_out(kind: type[Message], values: dict[str, object], named: str):
    found = verdict(list(changed(stream(), kind, **values)))
    assert found.difference is not None
    assert named in str(found.difference)


def test_another_seed_decides_otherwise():
    assert verdict(stream(), seed=8).difference is not None


def test_a_decision_that_is_missing_is_found_out():
    items = stream()
    first = next(k for k, (topic, _, _) in enumerate(items) if topic == "session/sample")
    assert verdict(items[:first] + items[first + 1 :]).difference is not None


def test_a_run_that_is_done_proves_its_sample():
    """The last sample could be taken out unnoticed: it is decided in the last second, which may not be recorded."""
    items = stream()
    last = max(k for k, (topic, _, _) in enumerate(items) if topic == "session/sample")
    done = next(k for k, (_, message, _) in enumerate(items) if k > last and getattr(message, "phase", "") == "DONE")
    found = verdict(items[:last] + items[last + 1 : done + 1]).difference
    assert found is not None
    assert isinstance(found.replayed, Sample)
    assert verdict(items[:last]).difference is None


def test_samples_that_are_missing_altogether_are_found_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    found = verdict([item for item in stream() if item[0] != "session/sample"])
    assert isinstance(found.difference.replayed if found.difference else None, Sample)
    path = forged(
        SESSION, tmp_path / "none.mcap", lambda items: (one for one in items if one.topic != "session/sample")
    )
    assert main(["check", str(path)]) == 1
    assert "the first that is not" in capsys.readouterr().out


def test_a_recording_may_end_at_any_moment():
    items = stream()
    for end in range(0, len(items), 701):
        assert verdict(items[:end]).difference is None


@pytest.mark.parametrize("first", ["event", "command"])
def test_a_session_that_the_user_stopped_is_the_same_whichever_of_its_last_messages_came_first(first: str):
    """The command to level, and the event that explains it, are of two topics: between those the bus keeps no order."""
    items = stream()[:-400]
    stop_ns = items[-1][2] + 1
    event = "session/event", RunEvent(stamp_ns=stop_ns, phase="ABORTED", reason="stopped by the user"), stop_ns + 1
    command = "arm/command", TiltCommand(stamp_ns=stop_ns, step=99), stop_ns + 2
    found = verdict([*items, *((event, command) if first == "event" else (command, event))])
    assert found.difference is None, str(found.difference)
    assert found.decisions > 50
