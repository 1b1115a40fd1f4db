"""A given simulation that is wrong is refused in one sentence, and the recording stays as it was."""

from __future__ import annotations

import hashlib
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import station
from shared.errors import UserError
from shared.rig import RigConfig
from station.__main__ import main
from station.app.simulated_again import simulated_again
from station.app.simulations import simulation_of
from station.diagnosis.diagnose import Examined, examined
from station.diagnosis.observations.setting import Setting
from station.diagnosis.report.summary import summary
from station.diagnosis.result import Diagnosis
from station.diagnosis.result_json import as_json
from station.physics.catalogue import catalogue
from station.physics.model import Model
from station.signals.session import Signals
from station.simulators.errors import errors
from station.simulators.same_runs import refuse_other_runs
from station.simulators.simulator import simulator
from station.simulators.yours.run import Run
from tests.unit.diagnosis import recorded as sessions
from tests.unit.diagnosis.recorded import GOLDEN, OPENING_RADIUS_M, joined, later, session

SETTING = Setting(opening_radius_m=OPENING_RADIUS_M)
NAME = "sim.mcap"


@cache
def rig() -> RigConfig:
    known = sessions.golden()[1]
    return replace(known, plate=replace(known.plate, opening_m=2 * OPENING_RADIUS_M))


@cache
def simulated() -> Signals:
    """The session of `session` as a simulation without scatter and noise."""
    return simulator("planar").repeat(session(), Model(mu_s=0.345), rig=rig())


def turned(signals: Signals, by_rad: float) -> Signals:
    """The same with the camera's frame turned on the plate."""
    assert signals.geometry is not None
    plate = np.reshape(signals.geometry.plate_from_pixel, (3, 3))
    c, s = np.cos(by_rad), np.sin(by_rad)
    other = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ plate
    return replace(signals, geometry=replace(signals.geometry, plate_from_pixel=tuple(other.ravel().tolist())))


def in_millimetres(signals: Signals) -> Signals:
    assert signals.geometry is not None
    plate = np.diag([1e3, 1e3, 1.0]) @ np.reshape(signals.geometry.plate_from_pixel, (3, 3))
    return replace(signals, geometry=replace(signals.geometry, plate_from_pixel=tuple(plate.ravel().tolist())))


def steeper(signals: Signals) -> Signals:
    """The plate's attitude with every tilt half as large."""
    w = signals.attitude.quaternion.copy()
    w[:, 1:] *= 0.5
    w[:, 0] = np.sqrt(1.0 - np.sum(w[:, 1:] ** 2, axis=1))
    return replace(signals, attitude=replace(signals.attitude, quaternion=w))


OTHERS: dict[str, tuple[Callable[[Signals], Signals], str]] = {
    "other runs": (lambda signals: joined([signals], first_run=500), "it has the runs 50"),
    "another frame": (
        lambda signals: turned(signals, np.pi / 2),
        "runs are others .* look at its runs, frames and units",
    ),
    "millimetres": (in_millimetres, "the block lies .* mm from where it was recorded"),
    "other tilts": (steeper, "the plate tilts to"),
    "no attitude": (
        lambda signals: replace(signals, attitude=signals.attitude.between(0, 1)),
        "Expected the plate's attitude",
    ),
    "no path": (lambda signals: replace(signals, geometry=None), "Expected the block's track"),
}


@pytest.mark.parametrize("name", OTHERS)
def test_a_simulation_of_something_else_is_one_sentence(name: str) -> None:
    change, words = OTHERS[name]
    with pytest.raises(UserError, match=words) as told:
        refuse_other_runs(session(), change(simulated()), name=NAME)
    assert "\n" not in str(told.value)


def test_a_simulation_of_the_same_commands_is_not_refused() -> None:
    refuse_other_runs(session(), simulated(), name=NAME)
    refuse_other_runs(session(), session(), name=NAME)


@pytest.mark.parametrize("ahead", [False, True])
def test_another_clock_and_another_rate_are_the_same_simulation(ahead: bool) -> None:
    signals = simulated()
    other = replace(signals, corners=signals.corners.select(slice(None, None, 3)))
    if ahead:
        other = later(other, 3_600_000_000_000, 0)
    was, now = errors(session(), signals), errors(session(), other)
    both = np.isfinite(now.path_mm) & np.isfinite(was.path_mm)  # where the block is in the picture
    assert both.sum() > 18
    assert np.median(now.path_mm[both]) == pytest.approx(np.median(was.path_mm[both]), rel=0.1)
    assert now.onset_deg == pytest.approx(was.onset_deg, nan_ok=True)


@cache
def plain() -> Examined:
    return examined(session(), catalogue(), setting=SETTING)


def answered(given: Signals) -> Diagnosis:
    own = simulation_of(given, rig=rig())
    found = simulated_again(plain(), session(), rig=rig(), setting=SETTING, simulation=own)
    assert summary(found)
    assert as_json(found)
    return found


def test_fewer_runs_are_compared_as_long_as_there_are_enough() -> None:
    most = [run for run in session().runs if run > 2]
    few = simulated().between(simulated().span_ns(most[0])[0] - 1, 2**62)
    found = answered(few)
    assert found.given
    assert found.fit.simulator_rerun["before"]["onsets"] < 24
    assert "recorded simulation could not be run" in found.fit.simulator_rerun["no_after"]
    half = simulated().between(0, simulated().span_ns(12)[0])
    with pytest.raises(UserError, match="at least 20 runs that can be compared"):
        answered(half)


def test_places_that_are_no_numbers_are_frames_that_are_lost() -> None:
    signals = simulated()
    pixels = signals.corners.corner_px.copy()
    pixels[::9] = np.nan
    assert answered(replace(signals, corners=replace(signals.corners, corner_px=pixels))).given


# --- the command ------------------------------------------------------------------------------------------------------

COMMANDS: dict[str, tuple[str, str, str]] = {
    "it raises": ("my_sim.py", "def simulate(run):\n    raise ValueError('no')\n", "it raised ValueError: no"),
    "it cannot be imported": ("my_sim.py", "import nothing_like_it\n", "importing it failed"),
    "no such file": ("none.py", "", "found none"),
    "another kind": ("my_sim.blend", "x", "a simulator of your own (*.py, *.xml)"),
    "a scene without the body": ("scene.xml", "<mujoco/>", "Expected the body block in scene.xml"),
}


@pytest.mark.parametrize("name", COMMANDS)
def test_the_recording_is_never_changed(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file, text, words = COMMANDS[name]
    monkeypatch.chdir(tmp_path)
    shutil.copy(GOLDEN, "session.mcap")
    if text:
        Path(file).write_text(text, encoding="utf-8")
    before = hashlib.sha256(Path("session.mcap").read_bytes()).hexdigest()
    code = main(["diagnose", "session.mcap", "--simulate", file])
    told = capsys.readouterr().err
    assert code == 2
    assert words in " ".join(told.split())
    assert hashlib.sha256(Path("session.mcap").read_bytes()).hexdigest() == before


def gives_nan(run: Run) -> object:
    return [[t, run.x_m, float("nan"), run.yaw_rad] for t in run.t_s]


def gives_text(run: Run) -> str:
    return f"run {run.number}"


def raises(run: Run) -> None:
    raise ValueError(f"run {run.number}")


AT_ONCE: dict[str, tuple[Any, str]] = {
    "a number": (3, "Expected a simulator's name, a file, a recording or a function to simulate with, got int"),
    "nan": (gives_nan, "gives_nan, run 0 of the session: expected finite numbers"),
    "a text": (gives_text, "gives_text, run 0 of the session: expected rows of t, x, y, yaw"),
    "an exception": (raises, "raises, run 0 of the session: it raised ValueError"),
    "a file without the function": ("my_sim.py:other", "Expected a function other in my_sim.py, found none"),
    "no such recording": ("none.mcap", "Expected a recording at none.mcap"),
    "other tilts": (None, "runs are others"),
}


@pytest.mark.parametrize("name", AT_ONCE)
def test_a_wrong_simulator_is_refused_before_the_recording_is_diagnosed(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object, **__: object) -> None:
        pytest.fail("the recording is diagnosed")

    given, words = AT_ONCE[name]
    monkeypatch.chdir(tmp_path)
    Path("my_sim.py").write_text("def simulate(run):\n    return None\n", encoding="utf-8")
    recording = station.open(GOLDEN)
    given = steeper(recording.signals) if given is None else given
    monkeypatch.setattr("station.app.diagnosing.examined", refuse)
    with pytest.raises(UserError, match=re.escape(words)):
        station.diagnose(recording, simulation=given)


def test_a_simulated_table_is_read_before_the_table_is_diagnosed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object, **__: object) -> None:
        pytest.fail("the table is diagnosed")

    table = tmp_path / "samples.csv"
    table.write_text("onset_angle_rad\n0.3\n", encoding="utf-8")
    monkeypatch.setattr("station.app.diagnosing.examined", refuse)
    with pytest.raises(UserError, match=r"none\.csv"):
        station.diagnose(table, simulation=tmp_path / "none.csv")


def test_a_table_is_not_simulated(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = tmp_path / "samples.csv"
    table.write_text("onset_angle_rad\n0.3\n", encoding="utf-8")
    assert main(["diagnose", str(table), "--simulate", "planar"]) == 2
    assert "Expected a simulated table" in " ".join(capsys.readouterr().err.split())
