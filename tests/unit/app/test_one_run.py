"""The moving drawing of one run: its moments are in order, and a recorded session has one beside its simulations."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from station.__main__ import main
from station.app.one_run import run_in_motion
from station.diagnosis.result import Diagnosis
from station.pages.caption import Caption, made_by
from station.pages.motion import Moving, moving_figure


def sliding(**changes: Any) -> Moving:
    time_s = np.linspace(-1.0, 3.0, 400)
    way = np.clip(time_s - 0.2, 0.0, 0.3) ** 2
    still = Moving(name="a < b", colour="#000", time_s=time_s, pose=np.column_stack([way, -way, 0.1 * way]))
    return replace(still, **changes)


CAPTION = Caption(shows="The run from above, with this & that.", count="1 run")


def figure_of(*blocks: Moving) -> str:
    with made_by("station diagnose a.mcap"):
        return moving_figure(blocks, size_m=(0.01, 0.02), lasts_s=1.0, shown_s=4.0, caption=CAPTION)


@pytest.mark.parametrize("pose", [None, np.zeros((400, 3))], ids=["slides", "rests"])
def test_moments_are_in_order_and_each_has_its_pose(pose: np.ndarray[Any, Any] | None) -> None:
    drawn = ET.fromstring(figure_of(sliding() if pose is None else sliding(pose=pose)))
    motions = list(drawn.iter("animateTransform"))
    assert [one.get("type") for one in motions] == ["translate", "rotate"]
    for one in motions:
        keys = [float(key) for key in one.get("keyTimes", "").split(";")]
        assert (keys[0], keys[-1]) == (0.0, 1.0)
        assert keys == sorted(keys)
        assert len(one.get("values", "").split(";")) == len(keys)


def test_a_bar_tells_the_scale() -> None:
    """It has a round length, in the drawing's millimetres."""
    drawn = ET.fromstring(figure_of(sliding()))
    (bar,) = (path.get("d", "") for path in drawn.iter("path"))
    assert [text.text for text in drawn.iter("text")][-1] == f"{bar.rpartition(' h ')[2]} mm"


def test_without_motion_it_shows_where_the_block_came_to() -> None:
    """It stands still on paper, and where somebody has motions switched off."""
    places = [group.get("transform", "") for group in ET.fromstring(figure_of(sliding())).iter("g")]
    assert places[0] == "translate(90.000 90.000)"  # mm; y is down in a drawing
    assert math.isclose(float(places[1][len("rotate(") : -1]), -math.degrees(0.009), abs_tol=0.01)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("one_run") / "a.mcap"
    assert main(["run", "--lockstep", "--samples", "3", "--seed", "1", "--out", str(path)]) == 0
    return path


def answer(*names: str, verdict: str = "supported", mu_s: float = 0.4) -> Diagnosis:
    """Returns as much of a diagnosis as the drawing asks for."""
    model = {"friction": {"mu_s": mu_s}, "effects": {"kinetic_drop": {"drop": 0.2}}}
    told = SimpleNamespace(mu_s=SimpleNamespace(value=mu_s), names=names, model=model, verdict=verdict)
    return cast(Diagnosis, told)


def test_a_session_has_its_middle_run_beside_what_was_found(recording: Path) -> None:
    with made_by("station diagnose a.mcap"):
        drawn = ET.fromstring(run_in_motion(recording, answer("kinetic_drop")))
        without = ET.fromstring(run_in_motion(recording, answer()))
    names = [text.text for text in drawn.iter("text")]
    assert names[:-1] == ["recorded", "simulated, plain", "simulated with what was found"]
    caption = drawn.findtext("figcaption") or ""
    assert caption.startswith("Run ")
    assert "Simulations are by the planar simulator" in caption
    assert len(list(without.iter("rect"))) == 2


def ways_mm(drawn: ET.Element) -> list[float]:
    """Returns the length of the way of each block that is drawn, from its first to its last place."""
    lines = [np.array([place.split(",") for place in one.get("points", "").split()], dtype=float)
             for one in drawn.iter("polyline")]  # fmt: skip
    return [float(np.hypot(*(line[-1] - line[0]))) for line in lines]


@pytest.mark.parametrize("mu_s", [0.3, 0.45])
def test_simulated_blocks_slide_from_where_the_recorded_one_did_whatever_the_mean(recording: Path, mu_s: float) -> None:
    """The recorded tilts end with the slides: with a mean friction above a run's own, its block would hold."""
    with made_by("station diagnose a.mcap"):
        drawn = ET.fromstring(run_in_motion(recording, answer("kinetic_drop", mu_s=mu_s)))
    recorded, plain, with_less_friction = ways_mm(drawn)
    assert recorded > 10.0
    assert plain == pytest.approx(recorded, rel=0.2)
    assert with_less_friction >= plain
    assert "at the run's own level of friction" in (drawn.findtext("figcaption") or "")


def test_what_cannot_be_tested_has_no_drawing(recording: Path) -> None:
    assert run_in_motion(recording, answer(verdict="untestable")) == ""
