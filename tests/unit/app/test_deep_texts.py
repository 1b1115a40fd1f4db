"""A recording may carry texts nested without end, or numbers without end: they are refused in a sentence."""

from __future__ import annotations

from pathlib import Path

import pytest

from shared.config import json_table, table_of
from shared.errors import UserError
from station.__main__ import main
from station.app.commands import compare_angles
from station.app.planned import recorded_plan
from station.recording.checkup.report import examine
from station.recording.for_viewers import for_viewers
from station.recording.reader import open_recording
from station.recording.writer import Recording
from tests.unit.recording import session

DEEP = "a = " + "[" * 50_000
DOTTED = ".".join("a" * 5_000) + " = 1"
DIGITS = "a = " + "9" * 5_000
LONG = "a = 1\n" + "#" * 2_000_000
TEXTS = pytest.mark.parametrize("text", [DEEP, DOTTED, DIGITS, LONG], ids=["deep", "dotted", "digits", "long"])


def recorded(path: Path, **changes: object) -> Path:
    with Recording(path, provenance=session.provenance(**changes)) as recording:
        for receive_ns, topic, message in session.traffic():
            recording.write_message(topic, message, receive_ns=receive_ns)
    return path


@TEXTS
def test_a_text_beyond_all_bounds_is_no_toml(text: str) -> None:
    with pytest.raises(UserError, match=r"^x: expected TOML"):
        table_of(text, "x")
    assert for_viewers(text) is None


@pytest.mark.parametrize("text", ["{not json", "3", "[]", '{"a": ' + "[" * 50_000, '{"a": ' + "9" * 5_000 + "}"])
def test_a_text_beyond_all_bounds_is_no_json(text: str) -> None:
    with pytest.raises(UserError, match=r"^x: expected a JSON object"):
        json_table(text, "x")


@TEXTS
def test_doctor_and_diagnose_do_without_what_is_no_toml(tmp_path: Path, text: str) -> None:
    reader = open_recording(recorded(tmp_path / "a.mcap", rig_toml=text, plan_toml=text))
    assert examine(reader).streams
    assert recorded_plan(reader) == ""


def test_a_frame_rate_beyond_all_numbers_is_none(tmp_path: Path) -> None:
    path = recorded(tmp_path / "a.mcap", rig_toml="camera.rate_hz = " + "9" * 400)
    assert main(["doctor", str(path)]) in (0, 1)


@TEXTS
def test_a_bag_is_written_whatever_the_rig_file_says(tmp_path: Path, text: str) -> None:
    path = recorded(tmp_path / "a.mcap", rig_toml=text)
    assert main(["convert", str(path), "--to", "rosbag2", "--out", str(tmp_path / "bag")]) == 0


@pytest.mark.parametrize("text", ["{not json", "3", '{"readings": "x"}'])
def test_a_comparison_that_is_none_is_told(tmp_path: Path, text: str) -> None:
    reader = open_recording(recorded(tmp_path / "a.mcap", extra={"comparison": text}))
    with pytest.raises(UserError, match="comparison of the recorded session"):
        compare_angles._readings(reader, 5)  # pyright: ignore[reportPrivateUsage]: the command needs stops for it
