"""`station verify`: what follows from a recording is identical, and every forgery is named with both values."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from shared.messages import MarkerCorners, RunEvent, Sample, TiltCommand
from station.__main__ import main
from station.app.verifying import Verification, verify
from station.friction.onset import RULE
from station.sampling.replay import STOPPED
from tests.unit.app.forging import Edit, Item, forged
from tests.unit.recording.session import record

GOLDEN = Path(__file__).parents[2] / "golden" / "session.mcap"
DECIDED = (RunEvent, TiltCommand, Sample)


def parts(found: Verification) -> dict[str, str]:
    return {part.name: part.state for part in found.parts}


def changed(kind: type, number: int, **values: object) -> Edit:
    """Another value in the message of a kind with that number."""

    def edit(items: Iterator[Item]) -> Iterable[Item]:
        count = 0
        for item in items:
            if isinstance(item.message, kind):
                count += 1
                if count == number:
                    yield item.with_message(replace(item.message, **values))  # pyright: ignore[reportArgumentType]
                    continue
            yield item

    return edit


def test_a_recording_as_it_was_made_is_identical(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verify", str(GOLDEN)]) == 0
    printed = capsys.readouterr().out
    assert "✓ decisions identical: all 157" in printed
    assert "✓ samples   identical: all 3" in printed
    assert "– corners   not derived" in printed
    assert "nobody signed it" in printed


def test_a_copy_by_the_forger_that_changes_nothing_is_identical(tmp_path: Path) -> None:
    found = verify(forged(GOLDEN, tmp_path / "copy.mcap", lambda items: items))
    assert found.holds
    assert found.first is None


@pytest.mark.parametrize(
    ("edit", "part", "topic", "field", "recorded"),
    [
        (changed(Sample, 2, onset_angle_rad=0.3), "samples", "session/sample", "onset_angle_rad", 0.3),
        (changed(Sample, 3, flags=("late",)), "samples", "session/sample", "flags", ("late",)),
        (changed(TiltCommand, 20, angle_rad=0.123), "decisions", "arm/command", "angle_rad", 0.123),
        (changed(RunEvent, 30, phase="DONE"), "decisions", "session/event", "phase", "DONE"),
    ],
)
def test_a_forged_decision_or_sample_is_found(
    tmp_path: Path, *, edit: Edit, part: str, topic: str, field: str, recorded: object
) -> None:
    found = verify(forged(GOLDEN, tmp_path / "forged.mcap", edit))
    assert not found.holds
    assert parts(found)[part] == "different"
    assert found.first is not None
    assert (found.first.topic, found.first.field, found.first.recorded) == (topic, field, recorded)
    assert found.first.derived != recorded
    assert found.first.stamp_ns > 0


def test_a_session_whose_onsets_had_another_rule_is_not_called_forged_without_the_reason(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another version states other errors of onsets: an old recording is honest, and differs all the same."""
    path = forged(GOLDEN, tmp_path / "old.mcap", changed(Sample, 2, onset_sigma_rad=1e-4))
    assert "rule" not in next(part for part in verify(path).parts if part.name == "samples").sentence
    monkeypatch.setattr("station.app.recordings.RULE", RULE + 1)
    reason = f"its onsets were estimated by rule {RULE}, this program has rule {RULE + 1}"
    assert main(["verify", str(path)]) == 1
    assert reason in capsys.readouterr().out
    assert main(["check", str(path)]) == 1
    assert reason in capsys.readouterr().out
    assert main(["verify", str(GOLDEN)]) == 0


def of_a_reference(items: Iterator[Item]) -> Iterable[Item]:
    """One coordinate of one frame of a reference position is 0.4 px off."""
    reference = done = False
    for item in items:
        if isinstance(item.message, RunEvent):
            reference = item.message.phase == "REFERENCE"
        if reference and not done and isinstance(item.message, MarkerCorners) and item.message.found:
            x, *others = item.message.corners_px
            done = True
            yield item.with_message(replace(item.message, corners_px=(x + 0.4, *others)))
            continue
        yield item
    assert done


def test_an_altered_corner_of_a_reference_position_is_found_without_a_picture(tmp_path: Path) -> None:
    found = verify(forged(GOLDEN, tmp_path / "forged.mcap", of_a_reference))
    assert not found.holds
    assert parts(found)["samples"] == "different"


def doubled_last_sample(items: Iterator[Item]) -> Iterable[Item]:
    last = None
    for item in items:
        last = item if isinstance(item.message, Sample) else last
        yield item
    assert last is not None
    assert isinstance(last.message, Sample)
    later = replace(last, log_ns=last.log_ns + 10**6)
    yield later.with_message(replace(last.message, run=last.message.run + 1))


def test_a_sample_that_was_added_is_found(tmp_path: Path) -> None:
    more = verify(forged(GOLDEN, tmp_path / "more.mcap", doubled_last_sample))
    assert parts(more)["samples"] == "different"
    assert more.first is not None
    assert more.first.field == ""
    assert more.first.derived is None


def test_a_sample_in_the_middle_that_was_left_out_is_found(tmp_path: Path) -> None:
    def edit(items: Iterator[Item]) -> Iterable[Item]:
        seen = 0
        for item in items:
            seen += isinstance(item.message, Sample)
            if not (seen == 2 and isinstance(item.message, Sample)):
                yield item

    assert parts(verify(forged(GOLDEN, tmp_path / "less.mcap", edit)))["samples"] == "different"


def stopped_after_run_1(*, keeping: tuple[type, ...]) -> Edit:
    """A stop after the first run; of what was decided later only these kinds are kept."""

    def edit(items: Iterator[Item]) -> Iterable[Item]:
        stopped = False
        for item in items:
            if not stopped or not isinstance(item.message, DECIDED) or isinstance(item.message, keeping):
                yield item
            if not stopped and isinstance(item.message, RunEvent) and item.message.phase == "DONE":
                stopped = True
                stop = RunEvent(stamp_ns=item.log_ns + 1, phase="ABORTED", reason=f"{STOPPED} a signal")
                yield replace(item, log_ns=item.log_ns + 1).with_message(stop)

    return edit


def test_a_forged_stop_hides_no_sample(tmp_path: Path) -> None:
    found = verify(forged(GOLDEN, tmp_path / "stopped.mcap", stopped_after_run_1(keeping=(Sample,))))
    assert parts(found) == parts(found) | {"decisions": "identical", "samples": "different"}
    assert found.first is not None
    assert found.first.derived is None


@pytest.mark.parametrize(
    ("keeping", "different"),
    [
        ((RunEvent, TiltCommand), "samples"),
        (DECIDED, "decisions"),
        ((RunEvent,), "decisions"),
        ((TiltCommand,), "decisions"),
    ],
)
def test_a_session_that_went_on_was_not_stopped(tmp_path: Path, keeping: tuple[type, ...], different: str) -> None:
    """One inserted event once ended the comparison: whatever followed it, but samples, was not looked at."""
    found = verify(forged(GOLDEN, tmp_path / "stopped.mcap", stopped_after_run_1(keeping=keeping)))
    assert not found.holds
    assert parts(found)["decisions"] == "different"
    assert parts(found)[different] == "different"


def test_json_says_the_same(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = forged(GOLDEN, tmp_path / "forged.mcap", changed(Sample, 1, onset_angle_rad=float("nan")))
    assert main(["verify", "--json", str(path)]) == 1
    told = json.loads(capsys.readouterr().out)
    assert told["holds"] is False
    names = ["content", "corners", "attitudes", "decisions", "samples", "plate"]  # a new one comes last
    assert [part["name"] for part in told["parts"]] == names
    first = told["first_difference"]
    assert (first["topic"], first["field"], first["recorded"]) == ("session/sample", "onset_angle_rad", None)
    assert told["signature"] is None


def test_a_session_made_by_hand_does_not_hold(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verify", str(record(tmp_path / "bench.mcap"))]) == 1
    assert "phase='REFERENCE', reason='', step=0), derived None" in capsys.readouterr().out


def test_a_damaged_file_is_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = bytearray(GOLDEN.read_bytes())
    data[len(data) // 2] ^= 1
    path = tmp_path / "damaged.mcap"
    path.write_bytes(data)
    assert main(["verify", str(path)]) == 2
    assert "is damaged" in capsys.readouterr().err
