"""The metadata of a session and the files that it carries say the same, or `verify` and `check` tell it."""

from __future__ import annotations

from pathlib import Path

import pytest

from station.__main__ import main
from station.app.described_otherwise import described_otherwise
from station.app.verifying import verify
from station.recording.reader import open_recording
from station.recording.writer import Recording
from tests.unit.recording import session

GOLDEN = Path(__file__).parents[2] / "golden" / "session.mcap"
SAID: dict[str, object] = {"rig_id": "simulated", "seed": 123}


def copied(folder: Path, **changed: object) -> Path:
    """The golden session with other metadata, whose checksums are right."""
    files = open_recording(GOLDEN).attachments
    texts = {"rig_toml": files["rig.toml"].decode(), "plan_toml": files["plan.toml"].decode()}
    with Recording(folder / "a.mcap", provenance=session.provenance(**{**texts, **SAID, **changed})) as recording:
        for item in open_recording(GOLDEN).messages():
            recording.write_message(item.topic, item.message, receive_ns=item.log_ns)
    return folder / "a.mcap"


@pytest.mark.parametrize(
    ("changed", "line", "said", "attached"),
    [({"rig_id": "other"}, "rig_id", "other", "simulated"), ({"seed": 99}, "seed", "99", "123")],
)
def test_metadata_that_were_changed_are_told(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    *,
    changed: dict[str, object],
    line: str,
    said: str,
    attached: str,
) -> None:
    """With a fresh checksum both answered that all was well."""
    path = copied(tmp_path, **changed)
    found = verify(path)
    assert not found.holds
    assert found.first is not None
    assert (found.first.topic, found.first.field) == ("metadata", line)
    assert (found.first.recorded, found.first.derived) == (said, attached)
    assert main(["check", str(path)]) == 1
    assert f"says {line} '{said}'" in capsys.readouterr().out


def test_metadata_as_they_were_written_agree(tmp_path: Path) -> None:
    path = copied(tmp_path)
    assert list(described_otherwise(open_recording(path))) == []
    assert verify(path).holds
    assert main(["check", str(path)]) == 0


def test_who_says_nothing_contradicts_nothing(tmp_path: Path) -> None:
    for number, changed in enumerate([{"seed": None}, {"plan_toml": ""}, {"plan_toml": "samples = 3\n"}]):
        (tmp_path / str(number)).mkdir()
        assert list(described_otherwise(open_recording(copied(tmp_path / str(number), **changed)))) == []
