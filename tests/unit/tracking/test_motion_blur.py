"""The motion along an edge is compared with the same by single points."""

import numpy as np
import pytest
from numpy.typing import NDArray

from pi_agent.rendering import Pose, Scene, surface
from pi_agent.rendering.projection import corners_px, project
from pi_agent.tracking.lines import along, expected_edges, places
from pi_agent.tracking.mark import Mark
from pi_agent.tracking.motion_blur import MotionBlur, bend
from pi_agent.tracking.shutter import Shutter

CENTRE = 240.0 + 310.0j
CORNERS = CENTRE + 60.0 * np.exp(0.4j) * np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j])
EDGES = expected_edges(CORNERS, clear_px=4.0)
COUNT = 6
POINTS = EDGES.middle[:, None] + np.multiply.outer(EDGES.tangent * EDGES.free, places(COUNT))


@pytest.mark.parametrize("turn_rad", [0.006, -0.006])
def test_an_edge_of_a_turning_mark_moves_further_where_it_is_further_out(turn_rad: float) -> None:
    motion_blur = MotionBlur(CENTRE, 3.0 - 1.0j, turn_rad)
    way = 3.0 - 1.0j + 1j * turn_rad * (POINTS - CENTRE)
    across = np.abs((EDGES.tangent[:, None].conj() * way).imag)
    inwards = motion_blur.inwards(EDGES)
    longer = along(motion_blur.longer(EDGES, inwards, than=np.abs(inwards)), count=COUNT)
    np.testing.assert_allclose(longer, across - np.abs(inwards)[:, None])
    assert np.abs(inwards) == pytest.approx(across.mean(axis=1))
    assert np.ptp(across, axis=1).max() > 0.3


@pytest.mark.parametrize("yaw_rate_rad_s", [3.0, -3.0])
@pytest.mark.parametrize("direction_rad", [0.0, 0.8, 1.6, 2.4])
def test_a_rolling_shutter_bends_an_edge_away_from_the_line_between_its_corners(
    yaw_rate_rad_s: float, direction_rad: float
) -> None:
    """The edge is compared with its points seen singly, each at its own row's time, while the mark slides too."""
    shutter = Shutter(line_ns=17_000.0)
    scene = Scene(surface("plain", rng=np.random.default_rng(0)), mark=Mark(side_mm=20.0), shutter=shutter)
    speed = 300.0 * np.array([np.cos(direction_rad), np.sin(direction_rad)])
    pose = Pose(2.0, -3.0, 0.5, float(speed[0]), float(speed[1]), yaw_rate_rad_s)
    corners = _complex(corners_px(scene, pose))
    edges = expected_edges(corners, clear_px=4.0)
    told = along(bend(edges, turn_per_row_rad=yaw_rate_rad_s * shutter.line_s), count=COUNT)
    start_mm = scene.mark.corners_mm()
    share = 0.5 + np.multiply.outer(edges.free / edges.length, places(COUNT))
    for edge in range(4):
        step = start_mm[(edge + 1) % 4] - start_mm[edge]
        seen = _at_own_rows(scene, pose, start_mm[edge] + share[edge][:, None] * step) - edges.start[edge]
        # The row's time moves a point along its edge as well, by a few hundredths of it.
        np.testing.assert_allclose(-(edges.tangent[edge].conj() * seen).imag, told[edge], atol=0.15 * LARGEST_PX)
    assert np.abs(told).max() > 0.5 * LARGEST_PX


LARGEST_PX = 3.0 * 17e-6 * 120.0**2 / 8.0


def _at_own_rows(scene: Scene, pose: Pose, points_mm: NDArray[np.float64]) -> NDArray[np.complex128]:
    rows, seen = np.zeros(len(points_mm)), points_mm
    for _ in range(8):
        times = scene.shutter.dt_s(rows)
        views = project(points_mm, pose, optics=scene.optics, height_mm=0.0, dt_s=times)
        seen = views[np.arange(len(rows)), np.arange(len(rows))]
        rows = seen[:, 1]
    return _complex(seen)


def _complex(points: NDArray[np.float64]) -> NDArray[np.complex128]:
    return np.asarray(points[:, 0] + 1j * points[:, 1], dtype=np.complex128)
