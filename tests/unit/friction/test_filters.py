"""The filters against slides of which a person can say by hand what each should flag."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from shared.messages import Sample
from station.friction.filters import DISTANCE_PX, Flags, count, filter_slides
from station.friction.robust import robust_distance2, robust_flags
from station.friction.slides import slides_of
from tests.unit.friction.sessions import GEOMETRY, sample, session

PX_M = 1 / 6000


def regular(number: int = 100) -> list[Sample]:
    """Slides that no filter flags: angles alternate by a little, marks hardly."""
    return [sample(run=run, angle_rad=0.35 + 0.01 * (-1) ** run) for run in range(1, number + 1)]


def flags_of(samples: Sequence[Sample], filter_of: Callable[..., Flags] = filter_slides) -> dict[str, set[int]]:
    slides = slides_of(samples, GEOMETRY)
    flags = filter_of(slides)
    return {name: {int(run) for run in slides.run[found]} for name, found in flags.by_filter.items() if found.any()}


def swollen(one: Sample, *, by: float, after: bool = False) -> Sample:
    name = "post_corners_px" if after else "reference_corners_px"
    corners = np.reshape(getattr(one, name), (4, 2))
    grown = corners.mean(axis=0) + (corners - corners.mean(axis=0)) * by
    return replace(one, **{name: tuple(grown.ravel().tolist())})


def test_regular_slides_are_all_kept():
    assert flags_of(regular()) == {}


def test_distance_is_the_mean_over_the_corners_and_twenty_pixels_are_enough():
    near = [sample(run=201, slide_m=19.9 * PX_M), sample(run=202, slide_m=20.1 * PX_M)]
    assert flags_of([*regular(), *near]) == {"distance": {201}}
    assert DISTANCE_PX == 20.0


def test_an_angle_beyond_three_standard_deviations_is_flagged_either_way():
    assert flags_of([*regular(), sample(run=201, angle_rad=0.45)]) == {"angle": {201}}
    assert flags_of([*regular(), sample(run=201, angle_rad=0.25)]) == {"angle": {201}}
    assert flags_of([*regular(), sample(run=201, angle_rad=0.365)]) == {}


@pytest.mark.parametrize("after", [False, True])
def test_a_mark_of_another_size_is_flagged_before_and_after(after: bool):
    shaken = [swollen(one, by=1 + 0.001 * (-1) ** one.run) for one in regular()]
    odd = swollen(sample(run=201), by=1.05, after=after)
    assert flags_of([*shaken, odd]) == {"circumference": {201}}


def test_a_slide_along_the_foam_is_flagged_and_one_across_is_not():
    along = sample(run=201, start_m=(0.0395, 0.004), azimuth_rad=0.0, slide_m=0.008)
    across = sample(run=202, start_m=(-0.0395, 0.0), azimuth_rad=math.pi / 2, slide_m=0.079)
    inward = sample(run=203, start_m=(0.0, 0.0395), azimuth_rad=0.0, slide_m=0.02)
    free = sample(run=204, start_m=(0.0345, 0.004), azimuth_rad=0.0, slide_m=0.008)
    assert flags_of([*regular(), along, across, inward, free]) == {"border": {201}}


def test_a_slide_that_ends_gliding_along_the_foam_is_flagged():
    gliding = sample(run=201, start_m=(0.034, 0.02), azimuth_rad=0.0, slide_m=0.0201, slide_rad=-1.3)
    slides = slides_of([gliding], GEOMETRY)
    reach = [float(np.linalg.norm(corners[0], axis=1).max()) for corners in (slides.pre_m, slides.post_m)]
    assert reach[0] > 0.044 or reach[1] > 0.044
    assert flags_of([*regular(), gliding])["border"] == {201}


def test_censored_runs_are_never_flagged_nor_counted_in_the_means():
    plain = [*regular(), sample(run=201, angle_rad=0.385)]
    stuck = [replace(sample(run=300 + i, angle_rad=1.1, slide_m=0.0), censored=True) for i in range(30)]
    assert flags_of([*plain, *stuck]) == flags_of(plain) == {"angle": {201}}
    row = count(filter_slides(slides_of([*plain, *stuck], GEOMETRY)))
    assert (row.samples, row.censored) == (101, 30)


def test_table_three_counts_a_twice_flagged_slide_once_as_unique_and_twice_in_total():
    odd = [sample(run=201, angle_rad=0.5, slide_m=0.001), sample(run=202, slide_m=0.002)]
    row = count(filter_slides(slides_of([*regular(), *odd], GEOMETRY)))
    assert (row.unique, row.total) == (2, 3)
    assert row.by_filter == {"distance": 2, "angle": 1, "circumference": 0, "border": 0}


def test_without_a_calibration_the_border_is_not_judged():
    flags = filter_slides(slides_of([sample(start_m=(0.0395, 0.004), slide_m=0.008)]))
    assert not flags.applicable["border"].any()
    assert not flags.by_filter["border"].any()
    assert flags.applicable["distance"].all()


def test_an_earlier_flag_of_the_border_counts_only_where_there_is_no_calibration():
    flagged = replace(sample(start_m=(0.0, 0.0)), flags=("border",))
    assert filter_slides(slides_of([flagged])).by_filter["border"].all()
    assert not filter_slides(slides_of([flagged], GEOMETRY)).by_filter["border"].any()


def test_gross_errors_hide_each_other_from_the_paper_but_not_from_the_median():
    rng = np.random.default_rng(5)
    good = [sample(run=run, angle_rad=0.35 + 0.01 * float(rng.standard_normal())) for run in range(1, 61)]
    gross = [sample(run=run, angle_rad=0.55) for run in range(201, 208)]
    assert "angle" not in flags_of([*good, *gross])
    assert flags_of([*good, *gross], robust_flags)["angle_mad"] == set(range(201, 208))


def test_robust_distances_of_normal_points_have_their_tail_and_a_hidden_point_is_found():
    rng = np.random.default_rng(3)
    points = rng.multivariate_normal([0, 0], [[1, 0.95], [0.95, 1]], 4000)
    odd = np.array([[1.8, -1.8]])  # ordinary in each coordinate alone
    distance2 = robust_distance2(np.concatenate([points, odd]))
    assert np.mean(distance2[:-1] > 11.83) == pytest.approx(0.0027, abs=0.002)
    assert distance2[-1] > 60


def test_the_alternatives_flag_few_of_a_clean_session():
    slides = slides_of(session(2000, rng=np.random.default_rng(8)), GEOMETRY)
    for filter_of in (filter_slides, robust_flags):
        for name, found in filter_of(slides).by_filter.items():
            assert found.mean() < 0.02, name
