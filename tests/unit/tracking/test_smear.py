"""What motion does along an edge, against the same by single points."""

import numpy as np
import pytest

from pi_agent.tracking.lines import along, expected_edges, places
from pi_agent.tracking.smear import Smear, Sweep

CENTRE = 240.0 + 310.0j
CORNERS = CENTRE + 60.0 * np.exp(0.4j) * np.array([-1 - 1j, 1 - 1j, 1 + 1j, -1 + 1j])
EDGES = expected_edges(CORNERS, clear_px=4.0)
COUNT = 6
POINTS = EDGES.middle[:, None] + np.multiply.outer(EDGES.tangent * EDGES.free, places(COUNT))


@pytest.mark.parametrize("turn_rad", [0.006, -0.006])
def test_an_edge_of_a_turning_mark_moves_further_where_it_is_further_out(turn_rad: float) -> None:
    smear = Smear(CENTRE, 3.0 - 1.0j, turn_rad)
    way = 3.0 - 1.0j + 1j * turn_rad * (POINTS - CENTRE)
    across = np.abs((EDGES.tangent[:, None].conj() * way).imag)
    longer = along(smear.longer(EDGES, than=smear.across(EDGES)), count=COUNT)
    np.testing.assert_allclose(longer, across - smear.across(EDGES)[:, None])
    assert smear.across(EDGES) == pytest.approx(across.mean(axis=1))
    assert np.ptp(across, axis=1).max() > 0.3


@pytest.mark.parametrize("yaw_rate_rad_s", [3.0, -3.0])
def test_a_rolling_shutter_bends_an_edge_by_the_motion_until_each_row(yaw_rate_rad_s: float) -> None:
    sweep = Sweep(CENTRE, 1500.0 + 700.0j, yaw_rate_rad_s, 17e-6)
    normal = -1j * EDGES.tangent[:, None]
    out = (normal.conj() * sweep.shift(POINTS)).real
    np.testing.assert_allclose(along(sweep.across(EDGES), count=COUNT), out, atol=1e-9)
    bend = out[:, 0] + out[:, -1] - out[:, 2] - out[:, 3]
    assert np.abs(bend).max() > 0.01
