"""`station export` over files: what it reads, writes, prints and answers."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shared.messages import Sample
from station.__main__ import main
from station.app import analysis_files
from station.export import export_formats
from station.export.reading import read_pairs
from station.recording.tables import write_samples
from station.recording.writer import Recording
from tests.recovery.engines import engines
from tests.recovery.engines.tilt import onset
from tests.unit.export.pairs import PAIRS, exported
from tests.unit.friction.sessions import GEOMETRY, sample, session
from tests.unit.recording.session import START_NS, provenance


def planted(count: int, *, object: str = "cube", mu: Callable[[float], float] = lambda _: 0.36) -> list[Sample]:
    samples = session(count, rng=np.random.default_rng(7), mu=mu)
    return [replace(one, object=object) for one in samples]


def table(samples: list[Sample], path: Path) -> Path:
    write_samples(samples, path)
    return path


def recorded(samples: list[Sample], path: Path) -> Path:
    with Recording(path, provenance=provenance()) as recording:
        recording.write_message("camera/geometry", replace(GEOMETRY, stamp_ns=START_NS), receive_ns=START_NS)
        for one in samples:
            recording.write_message("session/sample", one, receive_ns=START_NS + one.start_ns)
    return path


def pair_in(folder: Path, stem: str) -> dict[str, float]:
    found = json.loads((folder / "friction_pairs.json").read_text("utf-8"))["pairs"]
    return next(row for row in found if row["name"] == stem)


def test_recordings_and_tables_become_files_of_every_format(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    first = recorded(planted(80), tmp_path / "one.mcap")
    second = table(planted(60, object="felt", mu=lambda _: 0.6), tmp_path / "two.csv")
    out = tmp_path / "out"
    assert main(["export", str(first), str(second), "--format", "all", "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    written = {path.name for path in out.iterdir()}
    assert {"cube_on_wood.mjcf.xml", "felt_on_wood.usda", "felt_on_wood_bullet.py", "friction_pairs.csv"} <= written
    assert all(str(out / name) in printed for name in written)
    for stem, mu in (("cube_on_wood", 0.36), ("felt_on_wood", 0.6)):
        found = pair_in(out, stem)
        assert found["mu_1"] == found["mu_2"] == pytest.approx(mu, rel=0.05)
        assert found["scatter"] == pytest.approx(0.1, rel=0.4)
        assert found["mass_kg"] == pytest.approx(0.008)
    assert "cube on wood: what the files cannot say" in printed
    assert "drake, gazebo, mujoco, usd: Scatter from run to run is left out" in printed
    assert "In one scene, with one coefficient a material" in printed
    assert "max: cube 0.3" in printed


def on_an_ellipse(count: int, *, mu_1: float, mu_2: float, axis_rad: float, scatter: float = 0.05) -> list[Sample]:
    """Runs in all directions on a plate whose limit curve is an ellipse; the block goes along the ellipse's normal."""
    rng = np.random.default_rng(11)
    samples: list[Sample] = []
    for run in range(1, count + 1):
        azimuth, yaw = rng.uniform(0, 2 * math.pi, 2)
        pull = azimuth - math.pi / 2 - axis_rad
        held = 1 / math.hypot(math.cos(pull) / mu_1, math.sin(pull) / mu_2) * math.exp(scatter * rng.standard_normal())
        slide = axis_rad + math.atan2(math.sin(pull) / mu_2**2, math.cos(pull) / mu_1**2)
        one = sample(
            run=run, angle_rad=math.atan(held), azimuth_rad=float(azimuth), slide_rad=slide, yaw_rad=float(yaw)
        )
        samples.append(replace(one, object="felt"))
    return samples


def test_a_planted_ellipse_goes_through_samples_and_file_into_mujoco(tmp_path: Path):
    mu_1, mu_2, axis = 0.5, 0.35, math.radians(25)
    path = recorded(on_an_ellipse(250, mu_1=mu_1, mu_2=mu_2, axis_rad=axis), tmp_path / "t.mcap")
    assert main(["export", str(path), "--format", "mujoco,json", "--out", str(tmp_path)]) == 0
    found = read_pairs(tmp_path / "friction_pairs.json").pairs[0]
    assert found.fixed_in == "plate"
    assert (found.mu_1, found.mu_2) == pytest.approx((mu_1, mu_2), rel=0.03)
    assert found.axis_rad == pytest.approx(axis, abs=math.radians(3))
    assert found.mu_1_interval[0] < found.mu_1 < found.mu_1_interval[1]
    engine = engines()["MuJoCo"]
    for direction in np.arange(8) * math.pi / 4:
        pull = float(direction) - axis
        planted_rad = math.atan(1 / math.hypot(math.cos(pull) / mu_1, math.sin(pull) / mu_2))
        bench = engine.load(tmp_path, "felt_on_wood")
        seen = onset(bench, float(direction), expected_rad=planted_rad)
        assert seen.angle_rad == pytest.approx(planted_rad, abs=math.radians(0.6))


def test_too_few_slides_give_their_mean_and_say_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    path = table(planted(12), tmp_path / "t.csv")
    assert main(["export", str(path), "--format", "mujoco,json", "--out", str(tmp_path)]) == 0
    sentence = "The mean of the samples stands for all directions."
    assert sentence in capsys.readouterr().out
    found = read_pairs(tmp_path / "friction_pairs.json").pairs[0]
    assert found.isotropic
    assert found.samples == 12
    assert sentence in found.remarks[0]
    assert found.mu == pytest.approx(float(np.mean([math.tan(one.onset_angle_rad) for one in planted(12)])), rel=1e-6)


def test_pairs_come_back_from_their_own_json(tmp_path: Path):
    first = exported(tmp_path, "json") / "friction_pairs.json"
    assert [repr(pair) for pair in read_pairs(first).pairs] == [repr(pair) for pair in PAIRS.values()]
    out = tmp_path / "out"
    assert main(["export", str(first), "--format", "json,csv,mujoco", "--out", str(out)]) == 0
    assert (out / "friction_pairs.json").read_bytes() == first.read_bytes()
    rows = list(csv.DictReader((out / "friction_pairs.csv").read_text("utf-8").splitlines()))
    assert [float(row["mu_2"]) for row in rows] == [pair.mu_2 for pair in PAIRS.values()]
    assert (out / "wood_on_wood.mjcf.xml").exists()


def test_limit_curves_of_the_analysis_are_read_as_the_fit_itself(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(analysis_files, "figure_kinds", tuple)  # figures take seconds and have no part in this
    samples = [*on_an_ellipse(120, mu_1=0.5, mu_2=0.35, axis_rad=0.4), *planted(5)]
    path = table(samples, tmp_path / "t.csv")
    assert main(["analyze", str(path), "--out", str(tmp_path)]) == 1  # five slides are too few for a curve
    assert main(["export", str(path), "--out", str(tmp_path)]) == 0
    direct = read_pairs(tmp_path / "friction_pairs.json").pairs[1]
    capsys.readouterr()
    assert main(["export", str(tmp_path / "limit_curves.json"), "--out", str(tmp_path), "--overwrite"]) == 1
    assert "cube on wood: " in capsys.readouterr().out
    (curve,) = read_pairs(tmp_path / "friction_pairs.json").pairs
    assert curve.name == direct.name == "felt on wood"
    assert (curve.mu_1, curve.mu_2, curve.axis_rad) == pytest.approx((direct.mu_1, direct.mu_2, direct.axis_rad))
    assert curve.mu_1_interval == pytest.approx(direct.mu_1_interval)
    assert not curve.isotropic


def test_pairs_may_be_written_by_hand(tmp_path: Path):
    row = {"object": "ice", "plate": "steel", "mu_1": 0.03, "mu_2": 0.03}
    path = tmp_path / "mine.json"
    path.write_text(json.dumps({"format": "friction pairs", "pairs": [row]}))
    assert main(["export", str(path), "--format", "drake", "--out", str(tmp_path)]) == 0
    assert "<drake:mu_static>0.03<" in (tmp_path / "ice_on_steel.drake.sdf").read_text("utf-8")


def test_a_pair_without_a_slide_is_named_and_ends_with_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    stuck = [replace(one, censored=True) for one in planted(3, object="rubber")]
    path = table([*planted(12), *stuck], tmp_path / "t.csv")
    assert main(["export", str(path), "--format", "csv", "--out", str(tmp_path / "out")]) == 1
    assert "rubber on wood has no kept sample" in capsys.readouterr().out
    assert len((tmp_path / "out" / "friction_pairs.csv").read_text("utf-8").splitlines()) == 2


def test_files_are_not_replaced_unasked(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    path, out = exported(tmp_path, "json") / "friction_pairs.json", tmp_path / "out"
    words = ["export", str(path), "--format", "csv,usd", "--out", str(out)]
    assert main(words) == 0
    (out / "friction_pairs.csv").unlink()
    assert main(words) == 2
    assert "--overwrite" in capsys.readouterr().err
    assert not (out / "friction_pairs.csv").exists()  # nothing is written when not all can be
    assert main([*words, "--overwrite"]) == 0


def test_mistakes_are_one_sentence_and_end_with_two(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    def text(name: str, content: str) -> str:
        (tmp_path / name).write_text(content)
        return str(tmp_path / name)

    pairs = '{"format": "friction pairs", "pairs": [{"object": "a", "plate": "b", "mu_1": %s, "mu_2": 0.3%s}]}'
    fine = str(exported(tmp_path, "json") / "friction_pairs.json")
    degrees = str(table([replace(planted(1)[0], onset_angle_rad=21.0)], tmp_path / "degrees.csv"))
    stuck = str(table([replace(planted(1)[0], censored=True)], tmp_path / "stuck.csv"))
    for words, expected in (
        ([fine, "--format", "unity"], f"'all' or of {', '.join(sorted(export_formats()))}, got 'unity'"),
        ([fine, "--out", f"{fine}/x"], "Expected to write to the folder"),
        ([str(tmp_path / "none.json")], "none.json, but it cannot be read"),
        ([text("list.json", "[]")], "is neither (it holds no table)"),
        ([text("bad.json", "{")], "is neither"),
        ([text("empty.json", "{}")], "'pairs' is missing"),
        ([text("fit.json", '{"pairs": [{"object": "a"}]}')], "is missing"),
        ([text("low.json", pairs % (0.2, ""))], "a on b: expected mu_1 to be the higher, got 0.2 and 0.3"),
        ([text("negative.json", pairs % (-1, ""))], "expected mu_1 from 1e-09 to 1e+09, got -1"),
        ([text("word.json", pairs % ('"x"', ""))], "Expected a number for mu_1 of a pair, got 'x'"),
        ([text("frame.json", pairs % (0.4, ', "fixed_in": "sky"'))], "fixed_in of a on b is 'sky'"),
        ([degrees], "are these degrees?"),
        ([stuck], "Expected friction to export in"),
        ([str(tmp_path / "t.txt")], "Expected samples in a .csv, .parquet or .mcap file"),
    ):
        assert main(["export", *words]) == 2, words
        said = capsys.readouterr().err
        assert expected in said
        assert said.count("\n") == 1
