"""Simulated sessions keep the blank picture of a camera without pixels, with their own corners over it."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import cv2
import numpy as np
import pytest

from shared import frames
from shared.clock import SIMULATION_EPOCH_NS
from shared.messages import MarkerCorners, Message
from station.__main__ import main
from station.app.simulated_picture import IMAGE, OVERLAY, SimulatedPicture
from station.recording.reader import Recorded, open_recording

CORNERS = (10.0, 10.0, 20.0, 10.0, 20.0, 20.0, 10.0, 20.0)


def item(topic: str, message: Message) -> Recorded:
    now = SIMULATION_EPOCH_NS
    return Recorded(topic, payload=b"", log_ns=now, publish_ns=now, message=message)


def picture(*, textured: bool) -> Message:
    grey = np.full((40, 60), 110, dtype=np.uint8)
    grey[10:20, 10:20] -= 50 if textured else 0
    return frames.image(cv2.imencode(".png", grey)[1].tobytes(), stamp_ns=SIMULATION_EPOCH_NS, encoding="png")


def test_a_picture_that_shows_something_is_left_out() -> None:
    kept = SimulatedPicture()
    assert not [*kept.take(item(IMAGE, picture(textured=True)))]
    assert not [*kept.overlay(MarkerCorners(corners_px=CORNERS, found=True))]


@pytest.fixture(scope="module")
def again(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A session of a camera without pixels, and the same in the planar simulator."""
    folder = tmp_path_factory.mktemp("simulated")
    recorded, simulated = folder / "sim.mcap", folder / "again.mcap"
    assert main(["run", "--lockstep", "--samples", "2", "--seed", "3", "--out", str(recorded)]) == 0
    assert main(["simulate", str(recorded), "--out", str(simulated)]) == 0
    return recorded, simulated


def test_the_corners_are_drawn_over_the_blank_picture(again: tuple[Path, Path]) -> None:
    seen = Counter(one.topic for one in open_recording(again[1]).messages({IMAGE, OVERLAY}))
    assert seen[IMAGE] == 1
    assert seen[OVERLAY] > 10
