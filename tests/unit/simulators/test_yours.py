"""A function of the user's own as a simulator: what it gets, what it may give, and each way to be wrong."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from shared.errors import UserError
from shared.rig import RigConfig
from station.diagnosis.simulation_comparison import held
from station.physics.between import between
from station.physics.catalogue import catalogue
from station.physics.effect import Effect
from station.physics.model import Model, Term
from station.signals.session import Signals
from station.signals.tracks import AttitudeTrack
from station.simulators.errors import Errors, errors
from station.simulators.planar.plate import Plate
from station.simulators.planar.session import commands_of
from station.simulators.recorded_runs import recorded_runs
from station.simulators.simulator import Simulator, opened, simulator
from station.simulators.yours.called import of_function
from station.simulators.yours.found import Found, needs_telling
from station.simulators.yours.function import loaded
from station.simulators.yours.run import Run, run_of
from tests.unit.diagnosis import recorded as sessions
from tests.unit.simulators.point_block import point_block

MU = 0.25
AS_IT_IS = Model(mu_s=1.0)


@cache
def golden() -> tuple[Signals, RigConfig]:
    """Three runs, with the foam out of reach."""
    signals, rig = sessions.golden()
    return signals, replace(rig, plate=replace(rig.plate, opening_m=0.16))


def run_number(place: int, model: Model = AS_IT_IS) -> Run:
    signals, rig = golden()
    row = commands_of(signals, recorded_runs(signals), rig=rig).rows(slice(place, place + 1))
    return run_of(Plate(row, model))


def always(answer: float | None) -> Callable[[Run], float | None]:
    """A function that gives the same onset for every run."""

    def simulate(run: Run) -> float | None:
        return answer

    return simulate


def dropping(mu_s: float, drop: float) -> Model:
    return Model(mu_s=mu_s).with_term(Term(catalogue()["kinetic_drop"], {"drop": drop}))


def apart(function: Callable[..., Any], told: Model, truth: Model) -> Errors:
    """A function's simulation against the planar simulator's, which follows the same commands exactly."""
    signals, rig = golden()
    mine = of_function(function).repeat(signals, told, rig=rig)
    return errors(simulator("planar").repeat(signals, truth, rig=rig), mine)


# --- what it gets -----------------------------------------------------------------------------------------------------


def test_a_run_says_how_the_plate_stands_and_where_the_block_lies() -> None:
    signals, rig = golden()
    own, run = recorded_runs(signals)[1], run_number(1)
    assert (run.x_m, run.y_m, run.yaw_rad) == tuple(own.start)
    assert run.block_side_m == pytest.approx(rig.block.size_m[0])
    assert run.end_s == pytest.approx((own.end_ns - own.begin_ns) * 1e-9)
    assert np.diff(run.t_s).min() > 0
    stamps = own.begin_ns + np.round(run.t_s * 1e9).astype(np.int64)
    assert run.gravity_m_s2 == pytest.approx(9.81 * signals.attitude.gravity_at(stamps), abs=1e-9)
    assert run.tilt_rad == pytest.approx(signals.attitude.tilt_at(stamps), abs=1e-9)


def test_a_plate_with_play_is_told_by_the_run_alone() -> None:
    """It neither turns nor is set in motion while it waits, so that a function has nothing to do about it."""
    play = Model(mu_s=1.0, terms=(Term(catalogue()["backlash"], {"half_width_rad": 0.01}),))
    plain, run = run_number(0), run_number(0, play)
    assert not needs_telling(play)
    assert np.abs(run.gravity_m_s2 - plain.gravity_m_s2).max() > 0.05
    waits = np.all(run.rate_rad_s == 0.0, axis=1) & np.any(plain.rate_rad_s != 0.0, axis=1)
    assert waits.any()
    assert np.all(run.acceleration_rad_s2[waits] == 0.0)


def test_the_quaternion_turns_a_plate_as_gravity_says() -> None:
    run = run_number(0)
    turned = AttitudeTrack(
        time_ns=(run.t_s * 1e9).astype(np.int64),
        quaternion=run.world_from_plate,
        rate_rad_s=run.rate_rad_s,
        pivot_m=np.zeros((len(run.t_s), 3)),
    )
    assert 9.81 * turned.gravity == pytest.approx(run.gravity_m_s2, abs=1e-9)


def test_the_same_run_has_the_same_seed_and_another_run_another() -> None:
    assert [run_number(place).seed for place in (0, 1, 2, 0)] == [0, 1, 2, 0]


# --- what it may give -------------------------------------------------------------------------------------------------


def test_a_path_is_read_as_it_was_simulated() -> None:
    found = apart(point_block(MU, step_s=0.001), AS_IT_IS, Model(mu_s=MU))
    assert np.abs(found.onset_deg).max() < 0.05
    assert found.path_mm.max() < 0.2


def test_what_was_found_makes_it_the_simulator_that_it_is_not() -> None:
    told = between(dropping(0.35, 0.2), Model(mu_s=MU))
    found = apart(point_block(MU, step_s=0.001), told, dropping(0.35, 0.2))
    assert np.abs(found.onset_deg).max() < 0.05
    assert found.path_mm.max() < 1.0
    assert apart(point_block(MU), AS_IT_IS, dropping(0.35, 0.2)).onset_deg.max() < -4.0


def test_an_onset_that_is_stated_is_not_read() -> None:
    def stated(run: Run) -> Any:
        t, x, y, yaw = point_block(MU)(run, Found(AS_IT_IS, _row(), friction=1.0)).T
        return SimpleNamespace(t_s=t, x_m=x, y_m=y, yaw_rad=yaw, onset_s=1.25)

    signals, rig = golden()
    again = of_function(stated).repeat(signals, AS_IT_IS, rig=rig)
    for run, sample in zip(recorded_runs(signals), again.samples, strict=True):
        assert sample.slip_ns - run.begin_ns == pytest.approx(1.25e9)


def _row() -> Any:
    signals, rig = golden()
    return commands_of(signals, recorded_runs(signals), rig=rig).rows(slice(0, 1))


def test_an_onset_alone_leaves_the_slide_unseen() -> None:
    signals, rig = golden()
    again = of_function(always(2.0)).repeat(signals, AS_IT_IS, rig=rig)
    run = recorded_runs(signals)[0]
    frames = again.corners.between(run.begin_ns, run.end_ns)
    assert again.samples[0].slip_ns == run.begin_ns + 2_000_000_000
    assert not frames.found[frames.time_ns > again.samples[0].slip_ns].any()
    assert frames.found[frames.time_ns < again.samples[0].slip_ns].any()


def test_a_slide_that_is_not_told_has_no_path_error() -> None:
    signals, rig = golden()
    found = errors(signals, of_function(always(2.0)).repeat(signals, AS_IT_IS, rig=rig))
    assert np.isfinite(found.onset_deg).all()
    assert np.isnan(found.path_mm).all()
    assert np.isnan(found.turn_deg).all()
    holding = errors(signals, of_function(always(None)).repeat(signals, AS_IT_IS, rig=rig))
    assert np.isfinite(holding.path_mm).all()  # it lies where it was put


@pytest.mark.parametrize("nothing", [None, math.nan])
def test_a_block_that_holds_has_no_onset(nothing: float | None) -> None:
    signals, rig = golden()
    again = of_function(always(nothing)).repeat(signals, AS_IT_IS, rig=rig)
    assert all(sample.censored for sample in again.samples)


def test_a_function_that_gives_nothing_for_every_run_is_known_by_it() -> None:
    signals, rig = golden()
    for function, said in ((always(None), "gave None or nan (the block held) for"), (always(2.0), "")):
        simulated = of_function(function)
        simulated.repeat(signals, AS_IT_IS, rig=rig)
        assert simulated.gave == said


def test_it_is_a_simulator_like_ours() -> None:
    assert isinstance(of_function(point_block(MU)), Simulator)


# --- what was found ---------------------------------------------------------------------------------------------------


def test_before_anything_is_found_nothing_is_changed() -> None:
    found = Found(AS_IT_IS, _row())
    assert found.friction_multiplier(t_s=1.0) == 1.0
    assert found.force_per_mass(t_s=1.0) == pytest.approx(np.zeros(3))
    assert found.angular_acceleration(t_s=1.0, friction_m_s2=2.0) == 0.0


def test_many_states_are_answered_at_once_and_alike() -> None:
    found = Found(between(dropping(0.35, 0.2), Model(mu_s=MU)), _row())
    times, speeds = np.linspace(0.0, 2.0, 5), np.array([0.0, 0.01, 0.0, 0.1, 0.2])
    many = found.friction_multiplier(t_s=times, vx_m_s=speeds)
    alone = [found.friction_multiplier(t_s=t, vx_m_s=v) for t, v in zip(times.tolist(), speeds.tolist(), strict=True)]
    assert many == pytest.approx(alone)
    assert alone == pytest.approx([0.35 / MU * (0.8 if v else 1.0) for v in speeds.tolist()])


def test_pushes_and_turns_reach_it() -> None:
    effects = catalogue()
    off = Term(effects["uneven_contact"], {**effects["uneven_contact"].neutral(), "x_m": 1e-3})
    slow = Term(effects["viscous"], {**effects["viscous"].neutral(), "drag_n_s_m": 0.1})
    found = Found(between(Model(mu_s=MU, terms=(off, slow)), Model(mu_s=MU)), _row())
    push = found.force_per_mass(t_s=1.0, vx_m_s=0.2)
    assert push[0] == pytest.approx(-0.1 * 0.2 / golden()[1].block.mass_kg, rel=0.1)
    turning = [found.angular_acceleration(t_s=1.0, vy_m_s=0.2, friction_m_s2=force) for force in (1.0, 2.0)]
    assert turning[1] == pytest.approx(2.0 * turning[0])
    assert turning[0] != 0.0


def test_a_camera_is_the_tools_own_work() -> None:
    """A function that cannot be told of friction can be run with what the camera does."""
    effects = catalogue()
    late = between(
        Model(mu_s=MU, terms=(Term(effects["clock_offset"], {"delay_s": 0.03, "of_arm": 0.0}),)), Model(mu_s=MU)
    )
    signals, rig = golden()

    def untold(run: Run) -> Any:
        return point_block(MU)(run, Found(AS_IT_IS, _row()))

    plain = of_function(untold)
    on_time, delayed = (plain.repeat(signals, told, rig=rig) for told in (AS_IT_IS, late))
    for was, now in zip(on_time.samples, delayed.samples, strict=True):
        assert now.slip_ns - was.slip_ns == pytest.approx(30e6, abs=2)


# --- each way to be wrong ---------------------------------------------------------------------------------------------


def shifted(table: np.ndarray, **changes: float) -> np.ndarray:
    return table * np.array([1.0, changes.get("m", 1.0), changes.get("m", 1.0), changes.get("rad", 1.0)])


def _nan(table: np.ndarray) -> np.ndarray:
    table[7, 2] = math.nan
    return table


WRONG: dict[str, tuple[Callable[[np.ndarray], Any], str]] = {
    "not a number": (_nan, "expected finite numbers, got .*nan.* in row 7"),
    "three columns": (lambda table: table[:, :3], r"expected an array of shape \(k, 4\).*got shape"),
    "one moment": (lambda table: table[:1], "expected the path up to the run's end"),
    "text": (lambda _: "a path", "expected rows of t, x, y, yaw, a Path or an onset in seconds, got str"),
    "millimetres": (lambda table: shifted(table, m=1e3), "expected the path to begin where the block lies.*units"),
    "degrees": (lambda table: shifted(table, rad=180 / math.pi), "expected the path to begin where the block lies"),
    "backwards": (lambda table: table[::-1], "expected times that increase"),
    "too coarse": (lambda table: table[::25], "expected moments at most 0.05 s apart, got 0.1 s"),
    "it ends early": (lambda table: table[: len(table) // 2], "expected the path up to the run's end"),
    "unequal columns": (
        lambda table: SimpleNamespace(t_s=table[:, 0], x_m=table[1:, 1], y_m=table[:, 2], yaw_rad=table[:, 3]),
        "expected t_s, x_m, y_m and yaw_rad of one length",
    ),
    "a truth value": (lambda _: True, "a Path or an onset in seconds, got bool"),
    "complex numbers": (lambda table: table + 1j, "a Path or an onset in seconds, got ndarray"),
    "complex times": (
        lambda table: SimpleNamespace(t_s=table[:, 0] + 0j, x_m=table[:, 1], y_m=table[:, 2], yaw_rad=table[:, 3]),
        "a Path or an onset in seconds, got SimpleNamespace",
    ),
    "an onset after the end": (lambda _: 1e3, "expected an onset between 0 and"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_answer_is_one_sentence(name: str) -> None:
    spoil, words = WRONG[name]

    def spoilt(run: Run, found: Found) -> Any:
        return spoil(point_block(MU)(run, found))

    signals, rig = golden()
    with pytest.raises(UserError, match=words) as told:
        of_function(spoilt).repeat(signals, AS_IT_IS, rig=rig)
    assert str(told.value).startswith("spoilt, run ")
    assert "\n" not in str(told.value)


def test_a_function_without_a_second_argument_cannot_be_told_of_friction() -> None:
    signals, rig = golden()
    with pytest.raises(UserError, match="could not be run with what was found: it takes no second argument"):
        of_function(always(None)).repeat(signals, Model(mu_s=1.4), rig=rig)


# --- a file, in a process of its own ----------------------------------------------------------------------------------

HEAD = "import os, sys, time\n\ndef simulate(run, found=None):\n    "
FAILS: dict[str, tuple[str, str]] = {
    "raises": (f"{HEAD}raise KeyError('mu')", r"my_sim.py:simulate, run 0 of the session: it raised KeyError: 'mu'"),
    "exits": (f"{HEAD}sys.exit(3)", "it raised SystemExit: 3"),
    "dies": (f"{HEAD}os._exit(3)", "its process ended with status 3: .* calls os._exit"),
    "crashes": (
        f"{HEAD}os.abort()",
        "its process (was ended by SIGABRT: a library that it calls crashed|ended with status)",
    ),
    "asks": (f"{HEAD}return float(input())", "it raised EOFError"),
    "hangs": (f"{HEAD}time.sleep(60)", "within 0.5 s, but one run took longer; .* --simulate-limit"),
    "does not compile": ("def simulate(run:", "importing it failed: SyntaxError"),
    "lacks a package": ("import no_such_package", "importing it failed: ModuleNotFoundError"),
    "has no function": ("x = 1", "a function simulate in .*my_sim.py, found none; name another one"),
}


@pytest.mark.parametrize("name", FAILS)
def test_a_file_that_fails_is_one_sentence(name: str, tmp_path: Path) -> None:
    text, words = FAILS[name]
    (tmp_path / "my_sim.py").write_text(text, encoding="utf-8")
    signals, rig = golden()
    with pytest.raises(UserError, match=words) as told:
        opened(str(tmp_path / "my_sim.py"), limit_s=0.5).repeat(signals, AS_IT_IS, rig=rig)
    assert "\n" not in str(told.value)


def test_a_file_that_is_not_there_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"Expected a Python file with a simulator at .*none\.py, found none"):
        opened(str(tmp_path / "none.py"))


def test_a_file_may_print_and_import_its_neighbours(tmp_path: Path) -> None:
    (tmp_path / "neighbour.py").write_text("ONSET_S = 1.5\n", encoding="utf-8")
    text = "from neighbour import ONSET_S\n\ndef other(run):\n    print('hello')\n    return ONSET_S\n"
    (tmp_path / "my_sim.py").write_text(text, encoding="utf-8")
    signals, rig = golden()
    again = opened(f"{tmp_path / 'my_sim.py'}:other").repeat(signals, AS_IT_IS, rig=rig)
    for run, sample in zip(recorded_runs(signals), again.samples, strict=True):
        assert sample.slip_ns - run.begin_ns == pytest.approx(1.5e9)


ASKED = """
def simulate(run, found):
    state = {"t_s": 1.0, "x_m": 0.01, "vx_m_s": 0.1, "slid_from_s": 0.5}
    return abs(float(found.friction_multiplier(**state)) + float(found.force_per_mass(**state) @ [0.1, 0.01, 0.001]))
"""


def untold(effect: Effect) -> Model:
    """A model whose side lacks the effect: the law's shapes are those of whoever has it."""
    there = {one.name: one.low if one.is_shape else one.neutral for one in effect.parameters}
    return Model(mu_s=0.3, terms=(Term(held(effect), there),))


def sized(effect: Effect) -> Model:
    size = next(one for one in effect.parameters if not one.is_shape)
    return Model(mu_s=0.3, terms=(Term(effect, {**effect.neutral(), size.name: size.typical}),))


@pytest.fixture(scope="module")
def asked(tmp_path_factory: pytest.TempPathFactory) -> Simulator:
    file = tmp_path_factory.mktemp("asked") / "my_sim.py"
    file.write_text(ASKED, encoding="utf-8")
    return opened(str(file))


@pytest.mark.parametrize("effect", catalogue().values(), ids=lambda effect: effect.id)
def test_every_effect_reaches_a_process_of_its_own(effect: Effect, asked: Simulator, tmp_path: Path) -> None:
    """One that only the recording has, and one that only the simulation has."""
    signals, rig = golden()
    here = of_function(loaded(_written(tmp_path), "simulate"))
    for found in (between(sized(effect), untold(effect)), between(untold(effect), sized(effect))):
        there = asked.repeat(signals, found, rig=rig)
        assert [one.slip_ns for one in there.samples] == [
            one.slip_ns for one in here.repeat(signals, found, rig=rig).samples
        ]


def _written(folder: Path) -> Path:
    (folder / "here.py").write_text(ASKED, encoding="utf-8")
    return folder / "here.py"
