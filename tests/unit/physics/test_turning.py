"""The push of a turning frame, against a point that is followed in it by finite differences."""

from __future__ import annotations

import numpy as np

from station.physics.turning import turned_push


def test_a_point_at_rest_in_space_is_pushed_as_seen_from_a_turning_frame() -> None:
    """A frame turns about z by t² / 2 rad: what rests on it needs the opposite of the push to stay there."""
    place, at_s, step_s = np.array([0.3, -0.1, 0.2]), 1.3, 1e-4

    def in_space(time_s: float) -> np.ndarray:
        cos, sin = np.cos(0.5 * time_s**2), np.sin(0.5 * time_s**2)
        return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]]) @ place

    accelerated = (in_space(at_s + step_s) - 2.0 * in_space(at_s) + in_space(at_s - step_s)) / step_s**2
    cos, sin = np.cos(0.5 * at_s**2), np.sin(0.5 * at_s**2)
    in_frame = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]]) @ accelerated
    push = turned_push(np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, at_s]), place)
    np.testing.assert_allclose(push, -in_frame, atol=1e-6)
