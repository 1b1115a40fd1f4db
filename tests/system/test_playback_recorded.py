"""A recording played back onto the bus passes through the live pipeline: recorded again, it is the same."""

import signal
from pathlib import Path

import pytest

from station.__main__ import main
from station.recording.reader import open_recording
from tests.patience import PATIENCE_S
from tests.system.processes import CALM_HZ, end, rig_file, running, start

pytestmark = pytest.mark.system
GOLDEN = Path(__file__).parents[1] / "golden" / "session.mcap"


def test_a_played_back_session_is_recorded_and_decided_as_the_first_time(tmp_path: Path):
    rig, again = rig_file(tmp_path, rate_hz=CALM_HZ), tmp_path / "again.mcap"
    with running("station", "record", "--rig", str(rig), "--out", str(again)) as recorder:
        assert recorder.stdout is not None
        assert "Recording the bus" in recorder.stdout.readline()
        player = start("station", "replay", "--bus", str(GOLDEN), "--rig", str(rig), "--speed", "3")
        printed = player.communicate(timeout=PATIENCE_S)[0]
        assert player.returncode == 0, printed
        recorder.send_signal(signal.SIGINT)
        end(recorder)
    for topic in ("session/sample", "session/event", "arm/command", "camera/corners"):
        first, second = ([m.payload for m in open_recording(p).messages({topic})] for p in (GOLDEN, again))
        assert second == first, topic
    assert main(["samples", str(again)]) == 0
