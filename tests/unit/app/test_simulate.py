"""`station simulate`: a recording in, a recording of the same session in simulation out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from shared.messages import Sample
from station.__main__ import main
from station.app import progress
from station.app.attached import attached_rig
from station.app.onset_differences import difference
from station.app.simulated_recording import write_simulated
from station.recording.arrays import load_signals
from station.recording.reader import RecordingReader, digest, open_recording

GOLDEN = Path(__file__).parents[2] / "golden" / "session.mcap"
MODEL = "[friction]\nmu_s = 0.3464\n"


def simulated(folder: Path, *options: str, model: str = MODEL) -> RecordingReader:
    (folder / "model.toml").write_text(model)
    out = folder / f"sim{len(options)}.mcap"
    words = ["simulate", str(GOLDEN), "--model", str(folder / "model.toml"), "--out", str(out), *options]
    assert main(words) == 0
    return open_recording(out)


def test_the_same_session_comes_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, source = simulated(tmp_path), open_recording(GOLDEN)
    known = (info for info in out.topics.values() if info.message is not None)  # the others are for viewers
    assert {info.name: info.count for info in known} == {
        name: info.count for name, info in source.topics.items() if not name.startswith("truth/")
    }
    own, recorded = load_signals(out), load_signals(source)
    assert np.array_equal(own.corners.time_ns, recorded.corners.time_ns)
    assert np.array_equal(own.attitude.quaternion, recorded.attitude.quaternion)
    assert not np.array_equal(own.corners.corner_px, recorded.corners.corner_px)
    assert [sample.run for sample in own.samples] == [sample.run for sample in recorded.samples]
    assert all(sample.onset_angle_rad == pytest.approx(np.arctan(0.3464), abs=2e-3) for sample in own.samples)
    printed = capsys.readouterr().out
    assert "Onsets of 3 runs: mean difference" in printed


def test_a_long_writing_tells_how_far_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The recording holds the simulation's truth, too, which is not written again."""
    monkeypatch.setattr(progress, "EVERY_S", 0.0)
    simulated(tmp_path)
    measured = sum(1 for _ in open_recording(GOLDEN).messages())
    assert f"{measured} of {measured} messages written in " in capsys.readouterr().err


def test_it_says_where_it_comes_from(tmp_path: Path) -> None:
    out = simulated(tmp_path, "--seed", "3")
    session = out.metadata["session"]
    assert session["simulated_from"] == "session.mcap"
    assert session["simulator"] == "planar"
    assert session["simulation_seed"] == "3"
    assert out.attachments["model.toml"].decode() == MODEL
    assert out.attachments["rig.toml"] == open_recording(GOLDEN).attachments["rig.toml"]


@pytest.mark.parametrize("text", ["[/red]", "9" * 5000, "\u00b2", "-1", ""])
def test_metadata_that_are_no_numbers_are_left_out(tmp_path: Path, text: str) -> None:
    reader = open_recording(GOLDEN)
    reader.metadata["session"] |= {"started_ns": text, "seed": text}
    rig = attached_rig(reader)
    assert rig is not None
    write_simulated(reader, load_signals(reader), tmp_path / "a.mcap", rig=rig, said={}, model_toml="")
    session = open_recording(tmp_path / "a.mcap").metadata["session"]
    assert (session["started_ns"], session["seed"]) == (str(reader.start_ns), "")


def test_without_a_seed_it_is_the_same_every_time(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    first, second = (digest(simulated(tmp_path / name)) for name in ("a", "b"))
    assert first == second


@pytest.mark.parametrize(
    ("model", "word"),
    [
        ("[friction]\nmu = 0.3\n", "mu_s"),
        ("[friction]\nmu_s = 0.3\n[effects.magic]\nsize = 1\n", "magic"),
        ("[friction\n", "TOML"),
    ],
)
def test_a_wrong_model_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str], model: str, word: str) -> None:
    path, out = tmp_path / "model.toml", tmp_path / "sim.mcap"
    path.write_text(model)
    assert main(["simulate", str(GOLDEN), "--model", str(path), "--out", str(out)]) == 2
    said = capsys.readouterr().err
    assert word in said
    assert "model.toml" in said
    assert not list(tmp_path.glob("sim*"))


def test_an_unknown_simulator_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "model.toml").write_text(MODEL)
    words = ["simulate", str(GOLDEN), "--model", str(tmp_path / "model.toml"), "--out", str(tmp_path / "sim.mcap")]
    assert main([*words, "--simulator", "bullet"]) == 2
    assert "planar" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "has"), [((), "has its mean"), (("--seed", "3"), "draws another for each run")], ids=["mean", "drawn"]
)
def test_it_says_what_scatter_does_to_the_comparison(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: tuple[str, ...], has: str
) -> None:
    """Half of the runs that do not slide looks like a failure, and is what a model with the right mean gives."""
    simulated(tmp_path, *options)
    said = capsys.readouterr().out
    assert "scatters" not in said
    assert ("The model has no scatter" in said) == bool(options)
    (tmp_path / "scattered").mkdir()
    simulated(tmp_path / "scattered", *options, model=f"{MODEL}scatter = 0.06\n")
    said = capsys.readouterr().out
    assert said.count(f"Friction scatters by 6 % from run to run and the simulation {has}: ") == 1


def test_many_runs_are_summed_up() -> None:
    runs = [Sample(run=run, onset_angle_rad=0.3) for run in range(40)]
    again = [Sample(run=run, onset_angle_rad=0.3 + 1e-4 * run) for run in range(39)]
    again.append(Sample(run=39, censored=True, onset_angle_rad=0.5))
    lines = difference(runs, again)
    assert len(lines) == 1 + 20 + 3
    assert "of 39 runs" in lines[-3]
    assert lines[1].split()[0] == "19"
    assert "1 runs slid in the recording only" in lines[-1]
    assert "not in that mean" in lines[-1]
    assert difference([], []) == ["No run has an onset to compare"]
