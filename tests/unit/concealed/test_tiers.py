"""Each tier plans strengths in detection limits, classes, and names that tell nothing."""

import json
import math

import numpy as np
import pytest

from tests.concealed.cases import Analyst
from tests.concealed.catalogue import BEYOND, EFFECTS, plant
from tests.concealed.design import Design, Nuisance, Setting
from tests.concealed.protocols import draw_setting
from tests.concealed.sealing import sealed
from tests.concealed.session import run_session
from tests.concealed.tiers import CLASSES, plan_case
from tests.concealed.world import NULL
from tests.recovery.short_cases import MOST_RUNS, plan_short


def test_the_catalogue_is_that_of_the_physics_page():
    contact = {
        *("kinetic_drop", "stribeck", "rate_strengthening", "viscous", "contact_aging", "wear", "object_anisotropy"),
        *("plate_anisotropy", "one_way_friction", "friction_patch", "adhesion", "load_dependence", "presliding"),
        *("uneven_contact", "border_contact"),
    }
    rig = {"platform_level", "angle_scale", "backlash", "pivot_offset", "arm_vibration", "clock_offset"}
    camera = {"camera_sag", "lens_distortion", "rolling_shutter"}
    assert set(EFFECTS) == contact | rig | camera
    assert len(BEYOND) >= 5
    assert not set(BEYOND) & set(EFFECTS)


def test_the_limit_of_wear_is_that_of_a_regression():
    """An effect on the onsets alone: 2.8 standard errors of a regression of ln mu on the effect's own covariate."""
    setting = Setting(design=Design(runs=60, adapt_after=8, wide_deg=40.0), nuisance=Nuisance(scatter=0.1))
    session = run_session(setting, np.random.default_rng(1))
    planted = plant(EFFECTS["wear"], np.random.default_rng(0))
    limit = Analyst(session).limit(planted.apply, start=0.05)
    told = [run.facts.number for run in session.runs if not run.censored]
    unit = planted.apply(NULL, 0.01)
    course = -np.array(
        [1.0 - math.exp(-n / unit.wear_runs) if unit.wear_shape == 0.0 else n / unit.wear_runs for n in told]
    )
    expected = 2.8 * 0.1 / math.sqrt(((course - course.mean()) ** 2).sum())
    assert limit == pytest.approx(expected, rel=0.15)


def test_stronger_scatter_raises_the_limit():
    limits = []
    for scatter in (0.05, 0.15):
        setting = Setting(design=Design(runs=40, masses=(0.5, 1.0, 2.0)), nuisance=Nuisance(scatter=scatter))
        session = run_session(setting, np.random.default_rng(1))
        planted = plant(EFFECTS["adhesion"], np.random.default_rng(0))
        limits.append(Analyst(session).limit(planted.apply, start=0.05, onset_only=True))
    assert limits[1] / limits[0] == pytest.approx(3.0, rel=0.25)


def test_a_single_has_the_strength_that_it_says():
    plan = plan_case("single", 0, seed=5, only=("adhesion",))
    (effect,) = plan.entry["effects"]
    assert effect["id"] == "adhesion"
    assert effect["strength"] == pytest.approx(0.5, rel=1e-3)
    (place,) = plan.entry["places"]
    # Judged anew on the session as it was done.
    assert place["detectability"] == pytest.approx(0.5, rel=0.35)
    assert place["where"][0] == {"phase": "onset", "covariate": "load"}
    assert len(place["runs"]) == len(place["onset_sigmas"]) == len(place["path_sigmas"])


def test_confounded_cases_name_their_class_and_what_would_split_it():
    plan = plan_case("confounded", 0, seed=2)
    told = plan.entry["class"]
    assert plan.entry["effects"][0]["id"] in told["members"]
    assert len(told["members"]) >= 2
    assert told["next"]
    assert not plan.setting.design.yaw_varies
    assert plan.setting.design.mounts_deg == (0.0,)
    assert {kind.name for kind in CLASSES} >= {told["name"]}


@pytest.mark.parametrize("index", range(4))
def test_absorbed_effects_leave_no_trace_in_the_design(index: int):
    plan = plan_case("absorbed", index, seed=3)
    assert plan.entry["answer"] == "untestable"
    assert not plan.setting.design.second_sensor or plan.entry["effects"][0]["id"] != "angle_scale"
    assert plan.setting.design.masses == (1.0,) or plan.entry["effects"][0]["id"] == "angle_scale"


def test_settings_vary_as_they_should():
    settings = [draw_setting(np.random.default_rng(i)) for i in range(60)]
    assert {setting.design.pair for setting in settings} == {
        *("steel on steel", "steel on wood", "wood on steel", "wood on wood")
    }
    assert all(0.05 <= setting.nuisance.scatter <= 0.2 for setting in settings)
    assert all(0.1 <= setting.nuisance.noise_px <= 1.0 for setting in settings)
    assert all(50 <= setting.design.runs <= 500 for setting in settings)
    assert {len(setting.design.directions) for setting in settings} == {1, 4}
    assert any(setting.design.free for setting in settings)


def test_a_sealed_key_is_json_with_its_hash():
    text, digest = sealed({"b": 1, "a": [1.5]})
    assert json.loads(text) == {"a": [1.5], "b": 1}
    assert len(digest) == 64
    assert sealed({"a": [1.5], "b": 1}) == (text, digest)


def test_a_short_case_is_the_same_case_in_fewer_runs_and_leaves_the_next_one_as_long_as_it_was() -> None:
    long, short, again = (plan("null", 0, seed=1266) for plan in (plan_case, plan_short, plan_case))
    assert 50 <= short.setting.design.runs <= MOST_RUNS < long.setting.design.runs
    assert again.setting.design.runs == long.setting.design.runs
    assert (short.id, short.setting.design.pair) == (long.id, long.setting.design.pair)
