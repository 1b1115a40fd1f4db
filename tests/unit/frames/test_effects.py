"""An effect planted in the twin acts there by as much as was planted: on the truth, savings and all."""

import math

import numpy as np
import pytest

from tests.frames.effects import EFFECTS, NOTHING, Changes
from tests.frames.mechanisms import Ageing, Drag, KineticDrop, Patch, Wear
from tests.unit.frames.worlds import MU, Seen, drag_beside, friction_and_drag, gravity_at, places_m, session


@pytest.fixture(scope="module")
def plain() -> Seen:
    return session(NOTHING)


def test_without_an_effect_friction_is_the_pairs_at_onset_and_in_the_slide(plain: Seen):
    assert plain.onsets_mu == pytest.approx([MU] * 6, rel=2e-3)
    mu, drag = friction_and_drag(plain)
    assert mu == pytest.approx(MU, rel=0.02)
    assert drag == pytest.approx(0.0, abs=0.3)


def test_a_kinetic_drop_leaves_the_onset_and_lowers_the_slide():
    seen = session(Changes(influence=KineticDrop(0.2)))
    assert seen.onsets_mu == pytest.approx([MU] * 6, rel=0.015)
    mu, drag = friction_and_drag(seen)
    assert mu == pytest.approx(0.8 * MU, rel=0.02)
    assert drag == pytest.approx(0.0, abs=0.3)


def test_a_drag_grows_with_the_speed():
    """All of its blocks slide at 20 to 31 mm/s: friction is known from their onsets, and the rest is the drag.

    141 frames with .05 m/s2 of noise each tell it to within .15 /s; with friction free it would be known to 1.3 /s.
    """
    seen = session(Changes(influence=Drag(5.0)))
    assert seen.onsets_mu == pytest.approx([MU] * 6, rel=0.01)  # an onset is read from its slide, which drags
    assert drag_beside(MU, seen) == pytest.approx(5.0, rel=0.1)


def test_wear_lowers_friction_from_run_to_run():
    seen = session(Changes(influence=Wear(0.3, 5.0)))
    expected = [MU * (1.0 - 0.3 * (1.0 - math.exp(-run / 5.0))) for run in range(6)]
    assert seen.onsets_mu == pytest.approx(expected, rel=3e-3)


def test_a_contact_ages_while_it_lies():
    seen = session(Changes(influence=Ageing(0.2, 0.1)), dwell_s=(0.3, 30.0))
    lain = np.array([(one.slip_ns - one.rest_ns) * 1e-9 for one in seen.samples])
    assert lain.max() > 1.5 * lain.min()
    expected = MU * (1.0 + 0.2 * np.log10((lain + 0.1) / 1.1))
    assert seen.onsets_mu == pytest.approx(expected.tolist(), rel=0.015)
    assert min(seen.onsets_mu) > 1.1 * MU
    assert friction_and_drag(seen)[0] == pytest.approx(MU, rel=0.05)


def test_a_patch_is_where_it_is():
    seen = session(Changes(influence=Patch(0.4, 0.005, 0.0, 0.01)), placed_m=0.014)
    away = [math.hypot(one.start_x_m - 0.005, one.start_y_m) / 0.01 for one in seen.samples]
    assert max(away) > 1.2
    assert min(away) < 0.8
    assert seen.onsets_mu == pytest.approx([MU * (1.0 + 0.4 * math.exp(-0.5 * r * r)) for r in away], rel=5e-3)


@pytest.mark.parametrize("where", ["object", "plate"])
def test_an_ellipse_is_fixed_where_it_is_said_to_be(where: str):
    effect = EFFECTS[f"{where}_anisotropy"]
    told = {f"grain_{where}": 0.4, f"grain_{where}_axis": 0.5, f"grain_{where}_shape": 0.0}
    seen = session(effect.changes(told), yaw_varies=True)
    expected: list[float] = []
    for one in seen.samples:
        down = one.azimuth_rad - math.pi / 2 - 0.5 - (one.start_yaw_rad if where == "object" else 0.0)
        along, across = MU * math.exp(0.2), MU * math.exp(-0.2)
        expected.append(1.0 / math.hypot(math.cos(down) / along, math.sin(down) / across))
    assert max(expected) > 1.2 * min(expected)
    assert seen.onsets_mu == pytest.approx(expected, rel=0.01)


def test_a_leaning_base_pulls_where_it_leans():
    seen = session(EFFECTS["platform_level"].changes({"level_x": 0.03, "level_y": 0.0}))
    # Direction 1 slides towards +x, where gravity already pulls.
    shift = {1: -0.03, 3: 0.03}
    one_way = [one for one in seen.samples if one.direction in shift]
    assert one_way
    expected = [math.atan(MU) + shift[one.direction] for one in one_way]
    assert [one.onset_angle_rad for one in one_way] == pytest.approx(expected, abs=1e-3)


def test_late_stamps_are_late():
    seen = session(Changes(late=4), runs=2)
    shown, truth = places_m(seen.corners), np.array(seen.truth_m)
    apart = [np.abs(shown[5:] - truth[5 - ago : len(truth) - ago]).max() for ago in (3, 4, 5)]
    assert apart[1] < 5e-5
    assert min(apart[0], apart[2]) > 1e-3


def test_a_sagging_camera_moves_plate_and_block_uphill():
    seen = session(EFFECTS["camera_sag"].changes({"sag_px": 10.0}))
    stamps = np.array([one.capture_ns for one in seen.plate])
    place = np.array([one.corners_px for one in seen.plate]).reshape(-1, 4, 2).mean(axis=1)
    gravity = gravity_at(seen, stamps)[:, :2] / 9.81
    assert np.abs(gravity).max() > 0.3
    # The image's y is the plate's −y.
    assert place - place[0] == pytest.approx(-10.0 * gravity * (1.0, -1.0), abs=0.1)


def test_every_effect_is_drawn_and_changes_something():
    for effect in EFFECTS.values():
        told = effect.draw(np.random.default_rng(1))
        assert effect.value in told
        assert effect.changes(told) != NOTHING
