"""Importers give recordings that everything else takes like any other."""

from __future__ import annotations

import argparse
import math
import os
import tomllib
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from shared.clock import SIMULATION_EPOCH_NS
from shared.config import Table, parse
from shared.errors import UserError
from shared.foxglove import FrameTransforms
from shared.messages import BlockPose, RunEvent
from shared.rig import RigConfig
from station.app.commands import import_
from station.recording.arrays import load_signals, run_signals
from station.recording.checkup.report import examine
from station.recording.checkup.rules import findings
from station.recording.importers import cube_tosses, importers, write
from station.recording.reader import open_recording

REAL = Path(os.environ.get("REPOSE_CUBE_TOSSES", ""))
needs_data = pytest.mark.skipif(not REAL.is_file(), reason="REPOSE_CUBE_TOSSES does not name the table of tosses")


def made_up(path: Path, *, drop: str = "", lost: bool = False) -> Path:
    """Two tosses that slide 0.2 m and stop, the second one first in the file, with a hole in its frames."""
    rows: dict[str, list[float]] = {name: [] for name in ("toss", "frame", *cube_tosses._POSE)}  # pyright: ignore
    for toss, frames in ((7, [0, 1, 2, 5, 6]), (3, list(range(60)))):
        for frame in frames:
            x = 0.2 * min(frame / 40, 1.0)
            pose = (x, -0.1, 0.0524, 0.6, 0.0, 0.0, 0.8)
            if lost and frame == 2:
                pose = (math.nan,) * 7
            for name, value in zip(rows, (toss, frame, *pose), strict=True):
                rows[name].append(value)
    columns = {
        name: pa.array(values, pa.int32() if name in ("toss", "frame") else pa.float32())
        for name, values in rows.items()
        if name != drop
    }
    pq.write_table(pa.table(columns), path)
    return path


def converted(tmp_path: Path, **changes: object) -> Path:
    source = made_up(tmp_path / "tosses.parquet", **changes)  # pyright: ignore[reportArgumentType]
    (tmp_path / "LICENSE").write_text("BSD 3-Clause License")
    write(cube_tosses.read(source), tmp_path / "a.mcap")
    return tmp_path / "a.mcap"


def test_every_importer_has_a_name_and_a_line() -> None:
    found = importers()
    assert "cube-tosses" in found
    for name, importer in found.items():
        assert name == importer.NAME
        assert len(importer.HELP) > 10
        with pytest.raises(UserError, match="cannot be read: there is no such file"):
            importer.read(Path("/nowhere/at-all.parquet"))


def test_a_toss_is_a_run(tmp_path: Path) -> None:
    reader = open_recording(converted(tmp_path))
    samples = reader.samples()
    assert [sample.run for sample in samples] == [3, 7]
    assert all(sample.censored and sample.flags and sample.onset_angle_rad == 0 for sample in samples)
    assert samples[0].start_yaw_rad == pytest.approx(2 * math.atan2(0.8, 0.6), abs=1e-6)
    # It stops 40 frames after its start; the last millimetre before that counts as rest.
    assert samples[0].rest_ns - samples[0].start_ns == pytest.approx(40 / 148 * 1e9, abs=2e7)
    runs = dict(run_signals(reader, around_ns=0))
    assert len(runs[3].block) == 59
    times = (runs[7].block.time_ns - runs[7].block.time_ns[0]) * 148e-9
    assert times == pytest.approx([0, 1, 2, 5], abs=1e-6), "a frame that is missing leaves its time empty"


def test_poses_and_level_are_the_sources(tmp_path: Path) -> None:
    path = converted(tmp_path)
    signals = load_signals(open_recording(path))
    first = signals.run(3).block
    assert first.position_m[:, 0] == pytest.approx(0.2 * np.minimum(np.arange(60) / 40, 1), abs=1e-6)
    assert first.quaternion[0] == pytest.approx([0.6, 0, 0, 0.8], abs=1e-6)
    assert np.all(signals.attitude.tilt_rad == 0)
    assert np.diff(signals.attitude.time_ns).max() <= 10_000_000
    assert signals.attitude.time_ns[-1] >= signals.block.time_ns[-1]
    assert findings(examine(open_recording(path))) == ()


def test_transforms_follow_the_block(tmp_path: Path) -> None:
    reader = open_recording(converted(tmp_path))
    poses = [item.message for item in reader.messages({"block/pose"})]
    transforms = [item.message for item in reader.messages({"tf"})]
    assert len(transforms) == len(poses) == 65
    for pose, message in zip(poses, transforms, strict=True):
        assert isinstance(message, FrameTransforms)
        assert isinstance(pose, BlockPose)
        board, block = message.transforms
        assert (board.parent_frame_id, board.child_frame_id, block.child_frame_id) == ("world", "platform", "block")
        assert (block.translation.x, block.rotation.w) == (pose.x, pose.qw)


def test_it_says_where_it_comes_from(tmp_path: Path) -> None:
    reader = open_recording(converted(tmp_path))
    session = reader.metadata["session"]
    assert session["mode"] == "import"
    assert "BSD 3-Clause" in session["licence"]
    assert len(session["source_sha256"]) == 64
    assert reader.attachments["LICENSE"] == b"BSD 3-Clause License"
    rig = parse(RigConfig, Table(tomllib.loads(reader.attachments["rig.toml"].decode())))
    assert rig.block.size_m == (0.1048,) * 3
    assert rig.plate.side_m > 0.4
    assert reader.start_ns == SIMULATION_EPOCH_NS


def test_a_lost_pose_is_said_to_be_lost(tmp_path: Path) -> None:
    reader = open_recording(converted(tmp_path, lost=True))
    lost = [item.message for item in reader.messages({"block/pose"})]
    assert sum(not pose.found for pose in lost if isinstance(pose, BlockPose)) == 2
    assert reader.topics["tf"].count == 63


@pytest.mark.parametrize("bad", ["columns", "kind", "empty", "text"])
def test_a_wrong_source_is_named(bad: str, tmp_path: Path) -> None:
    source = tmp_path / "tosses.parquet"
    if bad == "columns":
        made_up(source, drop="qx")
    elif bad == "kind":
        source.write_bytes(b"no table")
    elif bad == "empty":
        pq.write_table(pq.read_table(made_up(source)).slice(0, 0), source)
    else:
        table = pq.read_table(made_up(source))
        words = pa.array(["left"] * table.num_rows)
        pq.write_table(table.set_column(2, "x_m", words), source)
    with pytest.raises(UserError):
        cube_tosses.read(source)


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = made_up(tmp_path / "tosses.parquet")
    parser = argparse.ArgumentParser()
    import_.add_arguments(parser)
    arguments = ["cube-tosses", str(source), "--out", str(tmp_path / "a.mcap")]
    assert import_.run(parser.parse_args(arguments)) == 0
    assert "2 runs" in capsys.readouterr().out
    with pytest.raises(UserError, match="exists"):
        import_.run(parser.parse_args(arguments))


@needs_data
def test_the_real_tosses(tmp_path: Path) -> None:
    write(cube_tosses.read(REAL), tmp_path / "a.mcap")
    reader = open_recording(tmp_path / "a.mcap")
    rows = pq.read_table(REAL).num_rows
    assert reader.topics["block/pose"].count == rows
    assert len(reader.samples()) == len({item.message.run for item in reader.messages({"session/event"})
                                         if isinstance(item.message, RunEvent)})  # fmt: skip
    assert b"BSD 3-Clause" in reader.attachments["LICENSE"]
    signals = load_signals(reader)
    ends = np.array([signals.run(run).block.position_m[-1, 2] for run in signals.runs[:20]])
    assert np.median(ends) == pytest.approx(0.0524, abs=2e-3), "the cube ends on a face"
    assert findings(examine(reader)) == ()
