"""A stretch of a session as a moving picture: drawn by the real viewer, in few pictures."""

from __future__ import annotations

from pathlib import Path

import pytest
from PIL import Image, ImageSequence

from shared.errors import UserError
from station.__main__ import main
from station.app import moving
from station.recording.reader import open_recording
from station.view import viewer
from station.view.setup import Setup
from tests.unit.diagnosis.recorded import GOLDEN


@pytest.mark.parametrize("name", ["picture.png", "picture"])
def test_only_what_can_move_is_taken(tmp_path: Path, name: str) -> None:
    with pytest.raises(UserError, match=r"[.]webp or [.]gif"):
        moving.write_moving(open_recording(GOLDEN), tmp_path / name, setup=Setup(), at_s=None)
    assert not (tmp_path / name).exists()


@pytest.mark.timeout(300)
@pytest.mark.skipif(not viewer.can_draw_headless(), reason="no Vulkan driver: apt-get install mesa-vulkan-drivers")
def test_the_slide_is_seen_to_move(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(moving, "BEFORE_S", 0.4)
    monkeypatch.setattr(moving, "AFTER_S", 0.4)
    assert main(["run", "--lockstep", "--samples", "1", "--seed", "1", "--out", "one.mcap"]) == 0
    assert main(["replay", "one.mcap", "--moving", "one.webp", "--no-viewer"]) == 0
    assert not Path("one.rrd").exists()
    with Image.open("one.webp") as made:
        assert made.size == (840, 499), "the window without its own bar, which shows nothing of a recording"
        shown = [frame.convert("RGB").tobytes() for frame in ImageSequence.Iterator(made)]
    assert len(shown) >= 3
    assert len(set(shown)) == len(shown), "two moments look the same"
