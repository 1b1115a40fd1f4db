"""The recordings are like those of a real session, and tell nothing of what is concealed in them."""

import json
import math
import subprocess
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shared.messages import MarkerCorners
from shared.rig import load_rig
from station.__main__ import main as station
from station.recording.arrays import load_signals
from station.recording.checkup.report import examine
from station.recording.checkup.rules import findings
from station.recording.reader import open_recording
from tests.concealed.__main__ import main
from tests.concealed.catalogue import EFFECTS, plant
from tests.concealed.design import Design, Nuisance, Setting
from tests.concealed.files import rig_toml, write_session
from tests.concealed.packing import Packer
from tests.concealed.session import SessionRecord, run_session
from tests.concealed.world import NULL, World

DESIGN = Design(
    runs=12, adapt_after=3, wide_deg=36.0, wide_steps=18, second_sensor=True, handled_every=5, yaw_varies=True
)
HARSH = Nuisance(scatter=0.1, noise_px=0.3, tail=4.0, noise_drift=1.0, knocks=0.2, dropouts=0.03)


def write(folder: Path, world: World, nuisance: Nuisance, *, seed: int = 3) -> tuple[Path, SessionRecord]:
    setting = Setting(design=DESIGN, nuisance=nuisance, world=world)
    session = run_session(setting, np.random.default_rng(seed))
    folder.mkdir()
    rig = rig_toml(setting, mu_guess=0.35, scatter_guess=0.1)
    (folder / "rig.toml").write_text(rig, encoding="utf-8")
    write_session(session, folder / "session.mcap", rig=rig, rng=np.random.default_rng(seed))
    return folder / "session.mcap", session


@pytest.fixture(scope="module")
def null(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, SessionRecord]:
    return write(tmp_path_factory.mktemp("concealed") / "null", NULL, Nuisance(scatter=0.1, noise_px=0.2))


@pytest.fixture(scope="module")
def harsh(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, SessionRecord]:
    world = plant(EFFECTS["kinetic_drop"], np.random.default_rng(1)).apply(NULL, 0.2)
    return write(tmp_path_factory.mktemp("concealed") / "harsh", world._replace(late_s=0.03, sag_px=8.0), HARSH)


@pytest.fixture(params=["null", "harsh"])
def written(request: pytest.FixtureRequest) -> tuple[Path, SessionRecord]:
    return request.getfixturevalue(request.param)


def test_the_doctor_finds_no_rule_broken(written: tuple[Path, SessionRecord]):
    assert findings(examine(open_recording(written[0]))) == ()


def test_it_reads_as_the_signals_of_a_session(written: tuple[Path, SessionRecord]):
    signals, session = load_signals(open_recording(written[0])), written[1]
    assert len(signals.samples) == len(session.runs) == 12
    assert signals.runs == tuple(range(13))
    assert signals.geometry is not None
    assert set(signals.fiducials) == {1}
    assert len(signals.angles["imu"])
    assert len(signals.environment)
    assert np.all(np.diff(signals.corners.time_ns) > 0)
    frames = sum(len(run.ride.frame_at) for run in session.runs)
    assert len(signals.corners) == frames + 179
    for run in session.runs:
        part = signals.run(int(run.facts.number) + 1)
        phases = [phase for phase in part.events.phase.tolist() if not phase.startswith("STEP")]
        expected = ["LEVEL", "DWELL", "REFERENCE", "TILT", "SLIP", "SETTLE", "RETURN", "DONE"]
        assert phases == [phase for phase in expected if not (run.censored and phase in ("SLIP", "SETTLE"))]
        assert float(part.attitude.tilt_rad.max()) == pytest.approx(float(run.ride.tilt.max()), abs=2e-6)


def test_corners_and_attitudes_come_back_as_they_were(null: tuple[Path, SessionRecord]):
    signals, session = load_signals(open_recording(null[0])), null[1]
    expected = np.concatenate([run.ride.corners_px for run in session.runs])
    got = signals.corners.corner_px[179:].reshape(-1, 8)
    seen = np.concatenate([run.ride.found for run in session.runs])
    np.testing.assert_allclose(got[seen], expected[seen], atol=1.1e-3)
    assert np.isnan(got[~seen]).all()
    pose = signals.corners.pose(signals.geometry)[179:] if signals.geometry else np.zeros((0, 3))
    first = session.runs[0]
    assert pose[0] == pytest.approx(first.start, abs=2e-3)


def test_samples_say_what_the_rig_would_have_said(null: tuple[Path, SessionRecord]):
    samples = load_signals(open_recording(null[0])).samples
    for sample, run in zip(samples, null[1].runs, strict=True):
        assert sample.censored == run.censored
        assert sample.direction == run.direction
        assert sample.previous_direction == run.previous
        assert sample.dwell_s >= 0.3
        assert (sample.start_x_m, sample.start_y_m) == pytest.approx(tuple(run.start[:2]), abs=1e-4)
        assert math.remainder(sample.start_yaw_rad - run.start[2], 2 * math.pi) == pytest.approx(0.0, abs=0.02)
        if not run.censored:
            # Estimated from noisy corners, not copied: near the truth, and never equal to it.
            error = sample.onset_angle_rad - run.ride.truths[1]
            assert 0.0 < abs(error) < math.radians(0.3)
            assert sample.step_from_rad - 1e-3 <= sample.onset_angle_rad <= sample.step_to_rad + 1e-3


def test_late_stamps_are_late_in_the_file_and_nowhere_else(harsh: tuple[Path, SessionRecord]):
    signals, session = load_signals(open_recording(harsh[0])), harsh[1]
    first = session.runs[0].ride
    shift = signals.corners.time_ns[179] - signals.attitude.time_ns[200]
    assert shift == pytest.approx(30_000_000 + (first.frame_at[0] - first.attitude_at[0]) / 900 * 1e9, abs=2)


def test_nothing_in_the_file_tells_what_is_concealed(
    null: tuple[Path, SessionRecord], harsh: tuple[Path, SessionRecord]
):
    a, b = open_recording(null[0]), open_recording(harsh[0])
    assert set(a.topics) == set(b.topics)
    assert not any(topic.startswith("truth") for topic in a.topics)
    assert a.metadata == b.metadata
    assert set(a.attachments) == set(b.attachments) == {"rig.toml"}
    assert a.attachments["rig.toml"] == b.attachments["rig.toml"]
    for reader in (a, b):
        assert {
            item.message.reason
            for item in reader.messages({"camera/corners"})
            if isinstance(item.message, MarkerCorners)
        } <= {"", "no mark found"}


def test_the_rig_file_is_one(written: tuple[Path, SessionRecord]):
    rig = load_rig(written[0].with_name("rig.toml"))
    assert rig.camera.rate_hz == 90.0
    known = set(tomllib.loads(rig.text))
    assert known == {"id", "camera", "mark", "plate", "block", "arm", "twin", "angles"}


def test_the_station_analyses_it(null: tuple[Path, SessionRecord], tmp_path: Path):
    assert station(["analyze", str(null[0]), "--out", str(tmp_path / "analysis")]) in (0, 1)
    assert (tmp_path / "analysis" / "samples.csv").exists()


def test_packed_messages_are_what_protobuf_reads():
    stamps = np.array([1_790_000_000_123_456_789, 1_790_000_001_000_000_000])
    corners = np.arange(16.0).reshape(2, 8)
    rows = Packer(2).stamp(1, stamps).small(2, 300).doubles(3, corners).flag(8, True).text(9, "dust").rows()
    for row, stamp, pixels in zip(rows, stamps, corners, strict=True):
        from shared import wire  # noqa: PLC0415

        message = wire.decode(MarkerCorners, row.tobytes())
        assert (message.capture_ns, message.seq, message.found, message.reason) == (stamp, 300, True, "dust")
        assert message.corners_px == tuple(pixels)
    with pytest.raises(ValueError, match="2\\^28"):
        Packer(1).small(2, 2**28)


# --- the command ------------------------------------------------------------------------------------------------------

COMMAND = [sys.executable, "-m", "tests.concealed"]
ROOT = Path(__file__).parents[3]


def make(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*COMMAND, "--out", str(folder), *words], cwd=ROOT, capture_output=True, text=True, check=False, timeout=280
    )


def test_a_case_is_the_same_again_and_is_not_made_twice(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    words = ("--tier", "null", "--cases", "1", "--seed", "11")
    one, other = make(tmp_path / "a", *words), make(tmp_path / "b", *words)
    assert (one.returncode, other.returncode) == (0, 0), one.stderr
    (case,) = [path for path in (tmp_path / "a").iterdir() if path.is_dir()]
    assert {path.name for path in case.iterdir()} == {"session.mcap", "rig.toml"}
    for name in ("session.mcap", "rig.toml"):
        assert (case / name).read_bytes() == (tmp_path / "b" / case.name / name).read_bytes()
    text = (tmp_path / "a" / "key.json").read_bytes()
    import hashlib  # noqa: PLC0415

    digest = hashlib.sha256(text).hexdigest()
    assert one.stdout.splitlines()[0] == f"key sha256 {digest}"
    assert (tmp_path / "a" / "key.sha256").read_text() == f"{digest}  key.json\n"
    entry = json.loads(text)["cases"][case.name]
    assert (entry["answer"], entry["effects"], entry["places"]) == ("none", [], [])

    before = (case / "session.mcap").stat().st_mtime_ns
    capsys.readouterr()
    assert main(["--out", str(tmp_path / "a"), *words]) == 0
    assert "0 of them written now" in capsys.readouterr().out
    assert (case / "session.mcap").stat().st_mtime_ns == before
    assert main(["--out", str(tmp_path / "a"), *words[:-1], "12"]) == 2
    assert "another one" in capsys.readouterr().err


def test_a_plan_in_a_null_world_has_nothing_in_it():
    from tests.concealed.cases import null_world  # noqa: PLC0415
    from tests.concealed.tiers import plan_case  # noqa: PLC0415

    for tier in ("null", "null_nuisance"):
        for index in range(3):
            plan = plan_case(tier, index, seed=1)
            assert plan.setting.world == null_world(plan.setting.world)
            assert replace(plan.setting, world=NULL).world == NULL
