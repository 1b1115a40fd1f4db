"""Bins along a direction and over the image, by hand."""

import math

import numpy as np
import pytest

from station.friction.bins import by_direction, heat_map


def test_thirty_two_bins_over_a_half_circle_with_mean_and_sd():
    direction = np.radians([1.0, 2.0, 5.7, 179.9, np.nan])
    bins = by_direction(direction, np.array([0.2, 0.4, 0.5, 0.7, 9.0]))
    assert len(bins.mean) == 32
    assert math.degrees(bins.middle_rad[1] - bins.middle_rad[0]) == pytest.approx(180 / 32)
    assert bins.count[[0, 1, 31]].tolist() == [2, 1, 1]
    assert bins.count.sum() == 4
    assert bins.mean[[0, 1, 31]] == pytest.approx([0.3, 0.5, 0.7])
    assert bins.sd[0] == pytest.approx(np.std([0.2, 0.4], ddof=1))
    assert np.isnan(bins.sd[1])
    assert np.isnan(bins.mean[2])


def test_patches_are_ten_by_ten_pixels_with_row_and_column_the_right_way_round():
    centres = np.array([[9.4, 0.0], [9.6, 0.0], [35.0, 599.0], [-3.0, 5.0], [np.nan, 1.0]])
    patches = heat_map(centres, np.array([0.1, 0.2, 0.3, 0.4, 0.5]), size_px=(600, 600))
    assert patches.shape == (60, 60)
    assert patches[0, 0] == pytest.approx(0.1)
    assert patches[0, 1] == pytest.approx(0.2)
    assert patches[59, 3] == pytest.approx(0.3)
    assert np.isfinite(patches).sum() == 3
