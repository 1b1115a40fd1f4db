"""The error that a sample states of its onset, against the friction that the twin drew for its run."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from station.__main__ import main
from station.recording.reader import open_recording
from station.rig.opening import Opening
from tests.soak.truth import Truth, column

SAMPLES = 60
CLEAR_M = 1e-3
"""A block this far from the foam is not held by it."""


def test_onsets_scatter_about_the_friction_as_they_state(tmp_path: Path) -> None:
    """Their robust standard deviation in the stated ones is 0.7 to 1.4, and 60 samples tell it to a quarter."""
    path = tmp_path / "session.mcap"
    assert main(["run", "--lockstep", "--samples", str(SAMPLES), "--seed", "20262602", "--out", str(path)]) == 0
    reader = open_recording(path)
    truth, samples = Truth.of(reader), [one for one in reader.samples() if not one.censored]
    drawn = truth.friction_rad[np.searchsorted(truth.time_ns, column(samples, "slip_ns")) - 1]
    pull = (column(samples, "onset_angle_rad") - drawn) / column(samples, "onset_sigma_rad")
    places = [column(samples, name) for name in ("start_x_m", "start_y_m", "start_yaw_rad")]
    clear = Opening(radius_m=0.045).room_m(np.full(len(pull), 0.005), (places[0], places[1], places[2])) > CLEAR_M
    assert clear.sum() > SAMPLES / 2
    middle = np.median(pull[clear])
    assert 0.7 / 1.25 < 1.4826 * np.median(np.abs(pull[clear] - middle)) < 1.4 * 1.25
