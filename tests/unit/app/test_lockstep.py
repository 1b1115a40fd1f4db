"""A simulated session: the same seed gives the same recording, in this process and in any other."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest

from shared import topics
from shared.clock import SIMULATION_EPOCH_NS
from shared.messages import RunEvent
from station.app import assembly, recordings
from station.app.lockstep import Lockstep
from station.app.processes import StopRequest
from station.recording.reader import digest, open_recording
from station.recording.writer import Recording
from tests.patience import PATIENCE_S
from tests.portable.paths import paths
from tests.portable.variants import PLAINEST, variants

SAMPLES = 2


def simulate(path: Path, *, seed: int, samples: int = SAMPLES) -> Path:
    """Records a session without pixels."""
    rig = assembly.rig_from(None)
    plan = assembly.plan_from(None, samples=samples, seed=seed)
    origin = recordings.provenance(rig, plan, mode="lockstep", started_ns=SIMULATION_EPOCH_NS)
    with Recording(path, provenance=origin) as recording:
        outcome = Lockstep(rig, plan, recording=recording).run()
    assert (outcome.samples, outcome.fault) == (samples, "")
    return path


def everything_in(path: Path) -> str:
    """SHA-256 of every message with its times, the truth among them, in the order of the file."""
    total = hashlib.sha256()
    for item in open_recording(path).messages(truth=True):
        total.update(f"{item.topic} {item.log_ns} {item.publish_ns} {len(item.payload)}\n".encode() + item.payload)
    return total.hexdigest()


def simulate_elsewhere(path: Path, environment: Mapping[str, str]) -> Path:
    """Records the first session in a process of its own, with more variables in its environment."""
    program = (
        "from pathlib import Path; from tests.unit.app.test_lockstep import simulate;"
        f"simulate(Path({str(path)!r}), seed=5)"
    )
    subprocess.run([sys.executable, "-c", program], env={**os.environ, **environment}, check=True, timeout=PATIENCE_S)
    return path


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return simulate(tmp_path_factory.mktemp("lockstep") / "first.mcap", seed=5)


def test_the_same_seed_gives_the_same_bytes(session: Path, tmp_path: Path) -> None:
    again = simulate(tmp_path / "again.mcap", seed=5)
    assert digest(open_recording(again)) == digest(open_recording(session))
    assert everything_in(again) == everything_in(session)


def test_another_process_gives_the_same_bytes(session: Path, tmp_path: Path) -> None:
    """Another process has other hashes, addresses and alignments; none of them may reach the measurements."""
    path = simulate_elsewhere(tmp_path / "elsewhere.mcap", {"PYTHONHASHSEED": "77", "PYTHONMALLOC": "malloc"})
    assert everything_in(path) == everything_in(session)


def test_another_processor_takes_the_same_decisions_and_measures_the_same_onsets(session: Path, tmp_path: Path) -> None:
    """Last bits differ, and contacts make more of them; no command, no event and no digit of the table may change."""
    plainest = next(one for one in variants(paths()) if one.name == PLAINEST)
    other = simulate_elsewhere(tmp_path / "plainest.mcap", plainest.environment)
    ours, theirs = (open_recording(path) for path in (session, other))
    decided, decided_there = (
        [(item.topic, item.message) for item in reader.messages({"arm/command", "session/event"})]
        for reader in (ours, theirs)
    )
    assert decided == decided_there
    onsets, onsets_there = ([sample.onset_angle_rad for sample in reader.samples()] for reader in (ours, theirs))
    assert onsets_there == pytest.approx(onsets, abs=1e-5)  # a tenth of the table's last digit, 0.01 degrees


def test_another_seed_gives_another_session(session: Path, tmp_path: Path) -> None:
    other = simulate(tmp_path / "other.mcap", seed=6)
    assert digest(open_recording(other)) != digest(open_recording(session))
    ours, theirs = (open_recording(path).samples() for path in (session, other))
    assert [sample.onset_angle_rad for sample in ours] != [sample.onset_angle_rad for sample in theirs]


def test_a_session_that_is_asked_to_stop_ends_its_run_in_words_and_keeps_its_samples(tmp_path: Path) -> None:
    rig, plan = assembly.rig_from(None), assembly.plan_from(None, samples=SAMPLES, seed=5)
    origin = recordings.provenance(rig, plan, mode="lockstep", started_ns=SIMULATION_EPOCH_NS)
    stop = StopRequest()
    with Recording(tmp_path / "stopped.mcap", provenance=origin) as recording:
        lockstep = Lockstep(rig, plan, recording=recording)
        outcome = lockstep.run(on_sample=lambda _: stop.ask("it is late"), stop=stop)
    assert (outcome.samples, outcome.fault) == (1, "it is late")
    reader = open_recording(tmp_path / "stopped.mcap")
    assert len(reader.samples()) == 1
    events = [item.message for item in reader.messages({"session/event"})]
    assert isinstance(events[-1], RunEvent)
    assert (events[-1].phase, events[-1].reason) == ("ABORTED", "it is late")


def test_no_two_messages_share_a_time_of_receipt(session: Path) -> None:
    stamps = [item.log_ns for item in open_recording(session).messages(truth=True)]
    assert len(set(stamps)) == len(stamps)
    assert stamps == sorted(stamps)


@pytest.mark.parametrize(
    ("topic", "rate_hz"),
    [
        ("camera/corners", 90.0),
        ("camera/calibration", 1.0),
        ("camera/geometry", 1.0),
        ("arm/joints", 100.0),
        ("arm/platform", 100.0),
        ("session/heartbeat", 15.0),
        ("tf", 29.0),
        ("clock", 2.0),
    ],
)
def test_every_topic_comes_as_often_as_promised(session: Path, topic: str, rate_hz: float) -> None:
    reader = open_recording(session)
    count = sum(1 for _ in reader.messages(topics=[topic]))
    assert count / reader.duration_s > 0.98 * rate_hz


def test_what_is_not_to_be_recorded_is_not(session: Path) -> None:
    there = set(open_recording(session).topics)
    assert there.isdisjoint(name for name, line in topics.TOPICS.items() if not line.recorded)
    assert "truth/scene" in there
