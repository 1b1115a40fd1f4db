import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from shared.rig import load_rig
from station.app.setting import setting_of
from station.diagnosis.inference.fit import fit
from station.diagnosis.inference.level import levelled
from station.diagnosis.observations.build import evidence_of
from station.physics.catalogue import catalogue
from station.physics.contact import Array, Bools
from station.physics.model import Model
from station.recording.arrays import load_signals
from station.recording.reader import open_recording
from tests.concealed.design import Design, Nuisance, Setting
from tests.concealed.files import rig_toml, write_session
from tests.concealed.session import run_session
from tests.proof.identify import Slide, identify, sysid
from tests.proof.rivals import NOT_HERE, TOGETHER, Table, held_out_corrected, reasons, rivals
from tests.proof.rivals.mujoco_sysid import slides_of
from tests.proof.terms import Terms, tables_of
from tests.proof.versus import versus
from tests.unit.proof.made_up import claim, concealed, place, said, scored, truth


def planted(rng: np.random.Generator, *, slope: float, rows: int = 240) -> Terms:
    """A table of onsets whose residuals follow its second column by `slope`, with a scatter of 5 %."""
    columns = rng.normal(size=(rows, 4))
    return Terms(
        channel="onset", phase="onset", names=("dwell", "run", "x", "load"), covariates=("dwell", "run", "x", "load"),
        columns=columns, residual=slope * columns[:, 1] + rng.normal(0.0, 0.05, rows),
        known=np.ones(rows, dtype=np.bool_), run=np.arange(rows),
    )  # fmt: skip


def test_every_file_is_a_rival_and_every_absent_one_has_a_reason():
    assert rivals().keys() == {"refit_mu", "best_bic", "pysindy", "gaussian_process", "mujoco_sysid"}
    assert all(reasons().values())
    assert NOT_HERE.keys() <= reasons().keys()


def slide_with(*, mu: float, drag_per_s: float, slope_deg: float, turn: float, mass_kg: float = 0.008) -> Slide:
    """A third of a second of Newton's law at 90 Hz, by steps of a tenth of a millisecond, seen to 0.01 mm."""
    time_s = np.arange(30) / 90.0
    fine = np.arange(0.0, time_s[-1] + 1e-3, 1e-4)
    slope, way = math.radians(slope_deg), np.array([math.cos(turn), math.sin(turn)])
    speed, gone = 0.03, np.zeros(len(fine))
    for step in range(1, len(fine)):
        speed += 1e-4 * (9.81 * (math.sin(slope) - mu * math.cos(slope)) - drag_per_s * speed)
        gone[step] = gone[step - 1] + 1e-4 * speed
    noise = 1e-5 * np.random.default_rng(1).standard_normal((len(time_s), 2))
    pull = 9.81 * np.array([*(math.sin(slope) * way), -math.cos(slope)])
    return Slide(
        time_s=time_s, place_m=np.interp(time_s, fine, gone)[:, None] * way + noise, velocity_m_s=0.03 * way,
        gravity_m_s2=np.tile(pull, (len(time_s), 1)), mass_kg=mass_kg,
    )  # fmt: skip


@pytest.mark.parametrize("drag_per_s", [0.0, 4.0])
def test_mujocos_own_identification_finds_the_planted_friction_of_every_slide(drag_per_s: float):
    if sysid() is None:
        pytest.skip("what mujoco.sysid needs is not installed")
    planted = (0.28, 0.32, 0.36)
    slides = [
        slide_with(mu=mu, drag_per_s=drag_per_s, slope_deg=math.degrees(math.atan(mu)) + 3.0, turn=turn)
        for mu, turn in zip(planted, (0.0, 2.0, 4.0), strict=True)
    ]
    found = identify(slides, side_m=0.01)
    assert found.mu == pytest.approx(planted, rel=0.01)
    assert found.drag_n_s_m / 0.008 == pytest.approx(drag_per_s, abs=0.3)


def test_mujocos_own_identification_says_what_it_lacks():
    why = rivals()["mujoco_sysid"].why_not()
    assert (why is None) == (sysid() is not None)
    assert why is None or "--group proof" in why


def table_of(folder: Path, *, runs: int) -> Table:
    """A session of the independent generator in which nothing is concealed; four folds."""
    setting = Setting(design=Design(runs=runs, adapt_after=2, wide_deg=36.0, wide_steps=18), nuisance=Nuisance())
    path, rig = folder / "session.mcap", rig_toml(setting, mu_guess=0.35, scatter_guess=0.1)
    (folder / "rig.toml").write_text(rig, encoding="utf-8")
    write_session(run_session(setting, np.random.default_rng(1)), path, rig=rig, rng=np.random.default_rng(1))
    signals = load_signals(open_recording(path))
    evidence = evidence_of(signals, setting_of(load_rig(folder / "rig.toml")))
    plain = fit(evidence, levelled(evidence, Model(mu_s=0.35)), ())
    fold = np.asarray(np.arange(evidence.runs) % 4, dtype=np.float64)
    return Table(signals=signals, evidence=evidence, plain=plain, fold=fold, catalogue=catalogue())


def test_a_rival_is_not_scored_on_a_correction_that_its_own_folds_call_worse(tmp_path: Path):
    table, rng = table_of(tmp_path, runs=24), np.random.default_rng(4)
    at = {terms.channel: terms.residual for terms in tables_of(table)}

    def score(predict: Callable[[str, Bools], Array]) -> float:
        return float(np.nanmean(held_out_corrected(table, at, predict).log_run))

    def noise(name: str, _: Bools) -> Array:
        return rng.normal(0.0, 10.0 * np.std(at[name]), len(at[name]))

    nothing = score(lambda name, _: np.zeros(len(at[name])))
    assert score(noise) == nothing
    friction = score(lambda name, train: 0.9 * at[name] if name in TOGETHER else noise(name, train))
    assert friction > nothing + 1.0
    assert score(lambda name, _: 0.9 * at[name]) > friction


def test_the_tilt_at_which_a_block_slid_explains_nothing(tmp_path: Path):
    for terms in tables_of(table_of(tmp_path, runs=8)):
        assert ("tilt" in terms.covariates) == (terms.phase == "pre-slip")
        assert "direction" in terms.covariates


def test_its_slides_are_those_of_the_evidence(tmp_path: Path):
    slides = slides_of(table_of(tmp_path, runs=4))
    assert len(slides) >= 3
    for slide in slides.values():
        # It goes down the slope, faster and faster, under all of gravity.
        gone = slide.place_m[-1] - slide.place_m[0]
        down = slide.gravity_m_s2[0, :2]
        assert gone @ down > 0.9 * np.hypot(*gone) * np.hypot(*down) > 0.0
        assert np.linalg.norm(slide.gravity_m_s2, axis=1) == pytest.approx(9.81, abs=0.01)
        assert (slide.time_s[0], slide.mass_kg) == (0.0, pytest.approx(0.00785))


def test_sparse_regression_finds_the_planted_term_and_nothing_in_noise():
    pytest.importorskip("pysindy")
    from tests.proof.rivals.pysindy_terms import sparse  # noqa: PLC0415  (needs the package)

    rng = np.random.default_rng(2)
    everything = np.ones(240, dtype=np.bool_)
    found = sparse(planted(rng, slope=0.06), everything)
    assert np.argmax(np.abs(found)) == 1
    assert found[1] == pytest.approx(0.06, abs=0.01)
    assert not np.any(sparse(planted(rng, slope=0.0), everything))


def test_a_gaussian_process_finds_the_covariate_that_matters():
    pytest.importorskip("sklearn")
    from tests.proof.rivals.gaussian_process import LEAST, important, length_scales  # noqa: PLC0415  (needs the package)

    for slope, matters in ((0.08, True), (0.0, False)):
        rng = np.random.default_rng(2)
        terms = planted(rng, slope=slope)
        size, where = important(terms, length_scales(terms, rng), rng)
        assert (size > LEAST and where == ("onset", "run")) is matters


def test_the_rivals_are_scored_on_the_same_cases():
    case = truth("single", concealed("viscous"))
    right = {"gain": 0.4, "se": 0.1, "names": ["viscous"], "place": ["slide", "slide_time"]}
    refit = {
        "oracle": {"gain": 0.5, "se": 0.05}, "tool": {"gain": 0.45, "se": 0.1},
        "rivals": {"pysindy": right, "best_bic": {"fault": "ValueError: no"}, "refit_mu": {"gain": 0.0, "names": []}},
    }  # fmt: skip
    answer = said(claim("viscous"), located=(place("slide", "speed"),))
    lines = {line.title: line for line in versus([scored(case, answer, **refit)], {})}
    tool, sindy = lines["station diagnose"], lines["sparse regression (PySINDy)"]
    assert (tool.name.value, tool.place.value, tool.gap.value) == (1.0, 1.0, pytest.approx(0.9))
    assert (sindy.name.value, sindy.place.value, sindy.gap.value) == (1.0, 0.0, pytest.approx(0.8))
    assert "failed on 1 of 1" in lines["best single term by BIC"].note
    assert lines["refit mu only"].gap.value == 0.0
    assert math.isnan(lines["refit mu only"].name.value)
    assert "mujoco.sysid: sliding friction and damping" in lines
