"""The station borrows objects of the camera agent."""

from __future__ import annotations

import pytest

from shared.errors import UserError
from station.app.camera_agent import borrowed


def test_the_agents_objects_are_found() -> None:
    """The two objects that the station uses are there in this checkout."""
    assert callable(borrowed("repose.picture_tracker", "mark", to=""))
    assert callable(borrowed("repose.lockstep_camera", "synthetic", to=""))


def test_without_the_agent_the_error_says_what_to_install() -> None:
    """The wheel of the station alone has no camera."""
    with pytest.raises(UserError, match=r"beside the station for --pixels .* install the whole `repose-friction`"):
        borrowed("repose.lockstep_camera", "nothing", to="for --pixels")
