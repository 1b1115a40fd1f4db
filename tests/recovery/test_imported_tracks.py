"""A session that is written as a table of tracks and imported gets the answer that the session itself gets."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from station.app.commands.diagnose import diagnose_file
from station.diagnosis.report.sentences import sentence
from station.friction.onset import estimate_onset
from station.recording.importers import tracks, write
from station.recording.reader import open_recording
from station.signals.session import Signals
from station.simulators.recorded_runs import poses_of
from tests.readmes.reader import tracks_of_the_page
from tests.recovery.given_sessions import SCATTER, model, simulated

DROP = 0.2


def table_of(session: Signals) -> dict[str, np.ndarray]:
    """Every run's frames on a clock of its own, with the plate's attitude at them."""
    poses, parts = poses_of(session), list[np.ndarray]()
    plate = session.attitude.at(poses.time_ns)
    for sample in session.samples:
        first, last = session.span_ns(sample.run)
        own = (poses.time_ns >= first) & (poses.time_ns <= last)
        run = np.full(own.sum(), float(sample.run))
        parts.append(np.column_stack([run, (poses.time_ns[own] - first) * 1e-9, poses.pose[own], plate[own]]))
    names = ["run", "t_s", "x_m", "y_m", "yaw_rad", "plate_qw", "plate_qx", "plate_qy", "plate_qz"]
    return dict(zip(names, np.concatenate(parts).T, strict=True))


@pytest.fixture(scope="module")
def session() -> Signals:
    return simulated(model(0.35, DROP, scatter=SCATTER), np.random.default_rng(20261342))


@pytest.fixture(scope="module")
def imported(session: Signals, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("tracks")
    pq.write_table(pa.table(table_of(session)), folder / "tracks.parquet")
    write(tracks.read(folder / "tracks.parquet", onset=estimate_onset), folder / "tracks.mcap")
    return folder / "tracks.mcap"


def test_the_onsets_are_those_that_the_rig_reads(session: Signals, imported: Path) -> None:
    read = {sample.run: sample for sample in open_recording(imported).samples()}
    for sample in session.samples:
        own = read[sample.run]
        assert own.censored == sample.censored
        if not sample.censored:
            assert own.onset_angle_rad == pytest.approx(sample.onset_angle_rad, abs=3e-4)


def test_the_planted_effect_is_named(imported: Path) -> None:
    answer = diagnose_file(imported).diagnosis
    claimed = [effect for effect in answer.effects if effect.verdict in ("supported", "indistinguishable")]
    assert [effect for effect in claimed if "kinetic_drop" in effect.class_ids] == claimed != [], sentence(answer)
    drop = claimed[0].parameters["drop"]
    assert abs(drop.value - DROP) < 3 * drop.sd


def test_the_law_of_the_pages_fixed_slope_is_named(tmp_path: Path) -> None:
    """Its sliding friction grows by 0.1 of static friction an e-fold beyond 10 mm/s; its yaw has no noise at all."""
    (tmp_path / "slope.csv").write_text(tracks_of_the_page()["slope.csv"], encoding="utf-8")
    write(tracks.read(tmp_path / "slope.csv", onset=estimate_onset), tmp_path / "slope.mcap")
    answer = diagnose_file(tmp_path / "slope.mcap").diagnosis
    (claimed,) = [effect for effect in answer.effects if effect.verdict in ("supported", "indistinguishable")]
    assert "rate_strengthening" in claimed.class_ids, sentence(answer)
    assert set(claimed.class_ids) <= {"rate_strengthening", "viscous", "other"}


@pytest.mark.parametrize("noise_m", ["2e-5", "1e-4"])
def test_blocks_that_all_start_from_one_spot_do_not_move_by_where_they_stand(noise_m: str, tmp_path: Path) -> None:
    """The first example of the page has one friction alone.

    Where a block seemed to stand had half its motion's noise: of seven such tables four had a finding.
    """
    text = tracks_of_the_page(noise_m)["tracks.csv"]
    (tmp_path / "tracks.csv").write_text(text, encoding="utf-8")
    write(tracks.read(tmp_path / "tracks.csv", onset=estimate_onset), tmp_path / "tracks.mcap")
    answer = diagnose_file(tmp_path / "tracks.mcap").diagnosis
    assert answer.effects == (), sentence(answer)
    assert answer.global_p > 0.01
