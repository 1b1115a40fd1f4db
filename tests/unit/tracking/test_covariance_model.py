"""A corner is doubtful for a cover's blurred edge, the end of a line seen in part, or a shadow's pull."""

import numpy as np
import pytest
from numpy.typing import NDArray

from pi_agent.tracking import covariance_model, lines, passes, profile_weights
from pi_agent.tracking.edges import Profiles
from pi_agent.tracking.steps import step_model

Floats = NDArray[np.float64]
COUNT = 48
WHOLE = np.full(4, float(COUNT))
CORNERS = np.array([0, 100, 100 + 100j, 100j], dtype=np.complex128)
EXPECTED = lines.expected_edges(CORNERS, clear_px=4.0)


def _line(offset: Floats, weight: Floats) -> lines.LineFit:
    return lines.fit_lines(offset, weight, start=None, floor_px=0.012, rounds=2)


def _noise(seed: int) -> Floats:
    return np.random.default_rng(seed).normal(0.0, 0.02, (4, COUNT))


def test_the_neighbours_of_what_covers_an_edge_are_spoiled_and_lone_outliers_are_not() -> None:
    offset = _noise(1)
    offset[0, 20:26] += 1.0
    offset[2, 30] += 1.0
    spoiled = covariance_model.beside_a_gap(_line(offset, np.ones((4, COUNT))), blur_px=0.9, shortest_px=92.0)
    assert spoiled is not None
    assert spoiled[0, 18:28].all()
    assert not spoiled[0, :16].any()
    assert not spoiled[0, 30:].any()
    assert not spoiled[1:].any()


def test_nothing_is_spoiled_beside_a_whole_edge() -> None:
    assert covariance_model.beside_a_gap(_line(_noise(2), np.ones((4, COUNT))), blur_px=0.9, shortest_px=92.0) is None


@pytest.mark.parametrize("seen", [COUNT, 18])
def test_the_variance_of_each_corner_is_that_of_many_lines(seen: int) -> None:
    """Corner 1 lies at the end of the edge that is seen in part, corner 0 at its start."""
    weight = np.ones((4, COUNT))
    weight[0, seen:] = 0.0
    corners, told = [], []
    for seed in range(400):
        line = _line(_noise(seed), weight)
        corners.append(lines.intersect(EXPECTED, line.offset, line.rise) - CORNERS)
        told.append(lines.at_corners(lines.point_variance(line), line, EXPECTED))
    variance = np.mean(np.abs(corners) ** 2, axis=0) / 2.0
    np.testing.assert_allclose(np.mean(told, axis=0), variance, rtol=0.3)


@pytest.mark.parametrize("differs", [True, False])
def test_an_edge_is_moved_by_what_a_shadow_pulls_where_the_light_differs(differs: bool) -> None:
    line = _line(_noise(3), np.ones((4, COUNT)))
    pull = 0.5 * _noise(4)
    pull[1] -= 0.1
    contrast = np.full((4, COUNT), 150.0, dtype=np.float32)
    if differs:
        contrast[1] = 90.0
    moves, left, read = covariance_model.out_of_shadow(pull, line, EXPECTED, contrast=contrast)
    if not differs:
        assert moves is None
        assert float(np.abs(left).max()) > 0.05
        return
    assert moves is not None
    np.testing.assert_allclose(moves, [0, -0.1, -0.1, 0], atol=0.02)
    assert float(np.abs(left).max()) < 0.02
    assert float(np.var(read.residual[1])) > float(np.var(line.residual[1]))


def _profiles(dark: Floats, contrast: Floats) -> Profiles:
    none = np.zeros((4, COUNT))
    flat = np.zeros((4, COUNT, 2), dtype=np.float32)
    noisy = dark + np.random.default_rng(6).normal(0.0, 0.5, dark.shape)
    light = noisy.astype(np.float32), contrast.astype(np.float32)
    return Profiles(none, none, flat, *light, none, none.astype(np.float32), None, flat)


def _lit(part: slice, *, dark: float, contrast: float) -> tuple[Floats, Floats]:
    """An outline of which a part of one edge is in another light: in shares of the rest's."""
    light = np.ones((2, 4, COUNT))
    light[0, 2, part], light[1, 2, part] = dark, contrast
    return 14.0 * light[0], 168.0 * light[1]


@pytest.mark.parametrize("contrast", [0.8, 1.2, 2.5])
def test_what_is_not_the_margin_beside_an_unchanged_dark_is_left_out(contrast: float) -> None:
    weight = np.ones((4, COUNT))
    light = profile_weights.beside_another(_profiles(*_lit(slice(16), dark=1.0, contrast=contrast)), weight)
    assert light == pytest.approx(abs(contrast - 1.0))
    assert not weight[2, :16].any()
    assert weight[2, 16:].all()
    assert weight[[0, 1, 3]].all()


@pytest.mark.parametrize(("dark", "contrast", "uneven"), [(0.5, 0.5, 0.5), (1.4, 1.0, 0.0), (1.0, 1.0, 0.0)])
def test_a_shadow_a_highlight_and_even_light_leave_the_margin_what_it_is(
    dark: float, contrast: float, uneven: float
) -> None:
    weight = np.ones((4, COUNT))
    light = profile_weights.beside_another(_profiles(*_lit(slice(24), dark=dark, contrast=contrast)), weight)
    assert light == pytest.approx(uneven)
    assert weight.all()


def _seen_in_part(seed: int) -> tuple[lines.LineFit, Floats]:
    weight = np.ones((4, COUNT))
    weight[2, :12] = 0.0
    return _line(_noise(seed), weight), np.random.default_rng(seed).normal(0.0, 0.5, (4, COUNT))


@pytest.mark.parametrize(("contrast", "dark", "another"), [(0.6, 1.0, True), (1.0, 1.0, False), (0.6, 0.6, False)])
def test_an_edge_seen_in_part_is_a_covers_if_its_contrast_is_another_and_no_shadow_makes_it(
    contrast: float, dark: float, another: bool
) -> None:
    line, noise = _seen_in_part(7)
    levels = np.ones((2, 4, 1))
    levels[0, 2], levels[1, 2] = contrast, dark
    shown, below = (90.0 * levels[0] + noise).astype(np.float32), (13.5 * levels[1] + noise).astype(np.float32)
    agreeing = np.array([COUNT, COUNT, COUNT - 12, COUNT])
    assert covariance_model.another(line, agreeing, contrast=shown, dark=below) is another


def test_a_whole_edge_is_not_suspected_for_its_contrast() -> None:
    line = _line(_noise(8), np.ones((4, COUNT)))
    contrast = np.full((4, COUNT), 90.0, dtype=np.float32)
    contrast[1] = 50.0
    dark = np.full((4, COUNT), 13.5, dtype=np.float32)
    assert not covariance_model.another(line, np.full(4, COUNT), contrast=contrast, dark=dark)


@pytest.mark.parametrize("seen", [8, 10, 14])
def test_few_points_that_agree_by_choice_are_taken_to_scatter_as_those_of_the_other_edges(seen: int) -> None:
    """The points of an edge that were left for agreeing have a scatter of their own that tells too little."""
    told = []
    for seed in range(200):
        offset, weight = _noise(seed), np.ones((4, COUNT))
        weight[1, :-20] = 0.0
        line = _line(offset, weight)
        weight[1, np.argsort(np.abs(line.residual[1]) + (weight[1] == 0) * 9.0)[seen:]] = 0.0
        line = _line(offset, weight)
        own, taken = lines.point_variance(line), covariance_model.margin_variance(line, profiles=WHOLE)
        told.append((own[1], taken[1], own[[0, 2, 3]].mean()))
        np.testing.assert_array_equal(np.delete(taken, 1), np.delete(own, 1))
    own_px2, taken_px2, others_px2 = np.mean(told, axis=0)
    assert own_px2 < 0.7 * others_px2
    assert taken_px2 > others_px2


def test_a_whole_edges_points_scatter_as_they_do() -> None:
    line = _line(_noise(9) * np.array([[1.0], [3.0], [1.0], [1.0]]), np.ones((4, COUNT)))
    np.testing.assert_array_equal(covariance_model.margin_variance(line, profiles=WHOLE), lines.point_variance(line))


def test_an_edge_with_a_notch_is_not_seen_in_part() -> None:
    weight, gap = np.ones((4, COUNT)), np.array([[0.3, 0.7]] * 4)
    left = profile_weights.leave_out(weight, EXPECTED, gap)
    np.testing.assert_array_equal(left, np.add.reduce(weight, axis=1))
    assert left.max() < 0.7 * COUNT
    line = _line(_noise(10), weight)
    np.testing.assert_array_equal(covariance_model.margin_variance(line, profiles=left), lines.point_variance(line))
    assert (covariance_model.margin_variance(line, profiles=WHOLE) > lines.point_variance(line)).all()


def _glowing(dark: Floats, contrast: Floats) -> NDArray[np.bool_]:
    """True for the profiles beside bare tape on which a highlight is taken to lie."""
    found = _profiles(dark, contrast)
    size = len(step_model(textured=True).steps)
    found = found._replace(
        light=np.repeat(found.dark[:, :, None], size, axis=2), sloped=np.zeros((4, COUNT, 2), np.float32)
    )
    read = profile_weights.level(
        found, np.ones((4, COUNT)), step_model(textured=True), blur=np.full(4, 0.8), typical=90.0, even=False
    )
    return np.zeros((4, COUNT), dtype=np.bool_) if read.glowing is None else read.glowing


def test_a_highlight_over_nearly_all_of_the_outline_is_not_what_is_usual() -> None:
    """The part that is lit least, an eighth of the outline, tells it; without that most of it would count as unlit."""
    added = np.full((4, COUNT), 50.0)
    added[0, :24] = 0.0
    added[2] += np.linspace(0.0, 30.0, COUNT)
    glowing = _glowing(14.0 + added, np.full((4, COUNT), 90.0))
    assert not glowing[0, :24].any()
    assert glowing[0, 24:].all()
    assert glowing[1:].all()


def test_neither_a_shadow_nor_the_plates_shades_are_a_highlight_on_the_rest() -> None:
    light, shades = np.ones((4, COUNT)), np.ones((4, COUNT))
    light[:2] = 0.3
    shades[2] = 0.8
    shades[3, :24] = 1.25
    assert not _glowing(14.0 * light, 90.0 * light * shades).any()


def test_a_blur_is_told_by_the_profiles_on_which_no_highlight_lies() -> None:
    glowing = np.ones((4, COUNT), dtype=np.bool_)
    glowing[:, :6] = False
    found = _profiles(*_lit(slice(0), dark=1.0, contrast=1.0))._replace(
        blur_change=np.where(glowing, -0.4, 0.03), glowing=glowing
    )
    corners, blur = CORNERS, np.full(4, 0.8)
    look = passes.Look(corners, blur, EXPECTED, step_model(textured=True), np.zeros(4), blur, np.ones(4), [])
    wider, change, share = passes.blur_change(found, _line(_noise(5), np.ones((4, COUNT))), look, shared_blur=True)
    np.testing.assert_allclose(wider, 0.03)
    np.testing.assert_allclose(change, 0.03)
    assert share == pytest.approx(1.0 / 8.0, abs=0.01)


def test_a_blur_that_only_this_frame_tells_adds_its_noise_to_sigma_and_light_that_is_noisy_is_not_rounded() -> None:
    line, nothing = _line(_noise(8), np.ones((4, COUNT))), np.zeros((4, COUNT))

    def variance(*, blur_known: bool, contrast: float) -> float:
        sigma = covariance_model.texture_sigma(
            nothing, line, EXPECTED, blur_off_px=np.zeros(4), blur_known=blur_known, contrast=contrast, path_px=0.0
        )
        return sigma.mean_px**2

    points = float(np.mean(lines.point_variance(line) / line.moments[:, 0]))
    gained = variance(blur_known=False, contrast=100.0) - variance(blur_known=True, contrast=100.0)
    assert gained == pytest.approx(covariance_model.TEXTURE_BLUR_NOISE * points)
    # A level of 255 is the twelfth part of a dim edge: that shows. Of a bright one it is the noise that counts.
    dim = variance(blur_known=True, contrast=12.0) - variance(blur_known=True, contrast=1e6)
    bright = variance(blur_known=True, contrast=100.0) - variance(blur_known=True, contrast=1e6)
    assert dim > 0.02**2
    assert bright < 0.001**2


@pytest.mark.parametrize(
    ("place", "offset_px", "texture_px", "bent"),
    [
        ("middle", 0.25, 0.0, True),  # beside an even margin nothing bends an edge but another edge
        ("middle", 0.25, 0.86, False),  # a streak or a pore of a textured plate
        ("middle", 0.25, 4.5, False),
        ("middle", 1.0, 4.5, False),  # the same under a motion blur
        ("middle", 1.0, 0.86, True),
        ("end", 0.25, 0.86, True),  # a cover leaves the edge's end to be seen
        ("end", 1.0, 4.5, True),
    ],
)
def test_neighbours_that_disagree_alike_show_another_edge_unless_grain_explains_it(
    place: str, offset_px: float, texture_px: float, bent: bool
) -> None:
    offset = _noise(6)
    offset[1, slice(20, 27) if place == "middle" else slice(COUNT - 7, COUNT)] += offset_px
    start = np.zeros(4), np.zeros(4)
    line = lines.fit_lines(offset, np.ones((4, COUNT)), start=start, floor_px=0.012, rounds=3)
    found = covariance_model.bent(line, np.ones((4, COUNT)), shortest_px=92.0, texture_px=np.full(4, texture_px))
    assert found == bent
