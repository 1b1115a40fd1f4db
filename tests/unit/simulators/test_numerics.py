"""The effects of a simulation's settings are found, with the setting that cures them; right ones get no word."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from shared.config import Table
from shared.errors import UserError
from shared.rig import RigConfig, rig_of_table
from station.physics.catalogue import catalogue
from station.physics.model import Model, Term
from station.signals.session import Signals
from station.simulators.artefacts import artefacts
from station.simulators.mujoco.numerics import BASELINE, checks, cures, numerics
from station.simulators.mujoco.own_settings import own_setup, setup_of_table
from station.simulators.mujoco.tilted import Setup
from station.simulators.planar.commands import Commands, ramps
from station.simulators.simulator import simulator
from tests.unit.simulators.test_planar_session import MU, golden


def settings(**values: Any) -> Setup:
    return setup_of_table(Table(values, "rig.toml", "", ("simulator", "mujoco")))


@cache
def ramp() -> Commands:
    """7 °/s to 26°: short, for each setting is tried on it."""
    return ramps((0.0, 2.5), (0.15, 0.46), downhill_rad=[0.0, 0.5])


@cache
def of_defaults() -> dict[tuple[str, str], dict[str, Any]]:
    return {(found["id"], found["unit"]): found for found in checks(ramp(), mu_s=MU)}


def test_mujocos_defaults_creep() -> None:
    early, crept = of_defaults()["solver_creep", "deg"], of_defaults()["solver_creep", "mm"]
    assert early["size"] == pytest.approx(early["after"] - early["before"])
    assert early["size"] > 2.0
    assert crept["before"] > 1.0
    assert crept["after"] < 0.1
    assert "impratio" in early["cured_by"]
    assert early["meant"] == "blocks start earlier"


def test_their_cone_is_a_pyramid() -> None:
    cone = of_defaults()["cone_artifact", "deg"]
    assert cone["before"] > 2.0
    assert cone["after"] < 0.5
    assert cone["cured_by"] == 'cone="elliptic"'


def test_of_right_settings_nothing_is_said() -> None:
    right = settings(cone="elliptic", impratio=100.0, noslip_iterations=3)
    assert checks(ramp(), mu_s=MU, baseline=right) == []


def test_the_cures_are_ordered_and_leave_the_users_other_settings() -> None:
    own = settings(timestep_s=0.004, solref=[0.01, 1.0])
    steps = [cure.setup.step_s for cure in cures(own)]
    assert steps == [0.002, 0.004, 0.004, 0.004, 0.002]
    assert {cure.setup.contact.solref for cure in cures(own)} == {(0.01, 1.0)}
    assert settings() == BASELINE


@pytest.mark.parametrize(
    ("table", "word"),
    [
        ({"cone": "round"}, "pyramidal"),
        ({"friction": 1}, "friction"),
        ({"impratio": -1.0}, "impratio"),
        ({"solref": [1]}, "list of 2 values"),
        ({"noslip_iterations": 0.5}, "whole number"),
        ({"noslip_iterations": -1}, "noslip_iterations"),
        ({"solver": "newton"}, "'Newton', 'CG', 'PGS'"),
    ],
)
def test_settings_that_cannot_be_are_refused(table: dict[str, Any], word: str) -> None:
    with pytest.raises(UserError, match=word):
        settings(**table)


def with_settings(rig: RigConfig, text: str) -> RigConfig:
    return rig_of_table(Table(tomllib.loads(rig.text + text), "rig.toml", rig.text + text))


def test_a_rig_files_settings_are_those_of_the_users_simulation() -> None:
    """The settings of a user who changes nothing creep: onsets that right settings hold are read degrees early."""
    recorded, rig = golden()
    assert own_setup(rig) is None
    text = '\n[simulator.mujoco]\ncone = "elliptic"\nsolver = "CG"\n'
    own = own_setup(with_settings(rig, text))
    assert own is not None
    assert own.solid
    assert own.contact.elliptic
    assert own.solver == "CG"
    right, soft = (
        simulator("mujoco").repeat(recorded, Model(mu_s=MU), rig=each) for each in (rig, with_settings(rig, text))
    )
    early = [a.onset_angle_rad - b.onset_angle_rad for a, b in zip(right.samples, soft.samples, strict=True)]
    assert np.degrees(np.median(early)) > 1.0


def test_settings_of_another_simulator_are_refused_with_their_line() -> None:
    _, rig = golden()
    with pytest.raises(UserError, match=r"line \d+: expected mujoco.*'simulator.drake'"):
        own_setup(with_settings(rig, "\n[simulator.drake]\nstep = 1\n"))
    with pytest.raises(UserError, match=r"line \d+: expected one of cone.*'simulator.mujoco.gravity', got an unknown"):
        own_setup(with_settings(rig, "\n[simulator.mujoco]\ngravity = 1\n"))


def test_recorded_tilts_are_tried() -> None:
    recorded, rig = golden()
    found = {check["id"] for check in numerics(recorded, rig=rig, mu_s=MU, runs=1)}
    assert found == {"solver_creep", "cone_artifact"}


# --- a simulation made elsewhere ------------------------------------------------------------------------------------


def made(*terms: Term) -> Signals:
    recorded, rig = golden()
    return simulator("planar").repeat(recorded, Model(mu_s=MU, terms=terms), rig=rig)


def creeping(time_s: float) -> Term:
    return Term(catalogue()["solver_creep"], {"time_s": time_s})


def test_a_simulation_that_creeps_shows_it() -> None:
    found = artefacts(made(creeping(2e-4)), mu_s=MU)
    assert {check["id"] for check in found} == {"solver_creep"}
    assert found[0]["unit"] == "mm"
    assert found[0]["size"] > 0.5
    assert found[0]["after"] is None


def test_one_that_does_not_shows_nothing() -> None:
    assert artefacts(made(), mu_s=MU) == []


def test_a_pyramid_shows_in_onsets_at_many_directions() -> None:
    """Nine runs with onsets as a pyramid of 1.5 % has them, and the same without."""
    recorded = many()
    assert artefacts(recorded(0.0), mu_s=MU) == []
    found = artefacts(recorded(0.03), mu_s=MU)
    assert [check["id"] for check in found] == ["cone_artifact"]
    assert found[0]["size"] == pytest.approx(np.degrees(0.03 * MU / (1 + MU**2)), rel=0.3)


@pytest.mark.parametrize("off_rad", [0.0, 1e-9, 1e-4, 0.035])
def test_tilts_along_the_axes_tell_nothing_of_what_lies_between(off_rad: float) -> None:
    """Directions that hardly differ, with onsets that differ by a hundredth of a degree."""
    near = many(lambda number: math.pi / 2 * number + off_rad * (number % 3))
    assert artefacts(near(0.03), mu_s=MU) == []


def many(turn_of: Callable[[int], float] = lambda number: 0.3 * number) -> Any:
    """The golden session told three times over, with onsets made from each slope's direction."""
    base = made()

    def with_swing(swing: float) -> Signals:
        samples = list[Any]()
        for number, sample in enumerate(base.samples * 4):
            turn = turn_of(number)
            ratio = 1.0 + 0.5 * swing * np.cos(4.0 * turn) + 1e-4 * (-1) ** number
            samples.append(replace(sample, onset_angle_rad=float(np.arctan(MU * ratio)), run=1000 + number))
        return told(base, samples, turn_of)

    return with_swing


def told(base: Signals, samples: list[Any], turn_of: Callable[[int], float]) -> Signals:
    """One short run for each sample, one after another: level, then tilted in the sample's direction."""
    pace, second = 0.5, 1_000_000_000
    times = np.arange(0, 2 * second * len(samples), second // 50)
    number, phase = times // (2 * second), (times % (2 * second)) / second
    tilt, turn = pace * np.clip(phase - 0.5, 0.0, 1.0), np.array([turn_of(int(one)) for one in number])
    quaternion = np.column_stack(
        [np.cos(tilt / 2), -np.sin(tilt / 2) * np.sin(turn), np.sin(tilt / 2) * np.cos(turn), 0 * tilt]
    )
    attitude = replace(base.attitude.select(np.zeros(len(times), dtype=int)), time_ns=times, quaternion=quaternion)
    corners = replace(base.corners.seen().select(np.zeros(len(times), dtype=int)), time_ns=times)
    events = replace(
        base.events.select(np.zeros(3 * len(samples), dtype=int)),
        time_ns=np.concatenate(
            [2 * second * k + np.array([0, second // 2, 2 * second - 1]) for k in range(len(samples))]
        ),
        run=np.repeat([sample.run for sample in samples], 3),
        phase=np.tile(np.array(["REFERENCE", "TILT", "DONE"]), len(samples)),
    )
    slips = [2 * second * k + second // 2 + round(second * s.onset_angle_rad / pace) for k, s in enumerate(samples)]
    moved = tuple(replace(sample, slip_ns=slip, censored=False) for sample, slip in zip(samples, slips, strict=True))
    return replace(base, attitude=attitude, corners=corners, events=events, samples=moved)
