"""A simulator of the user's own that is called: the answer is about the difference, and it gets better by it."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from station.app.simulated_again import simulated_again
from station.app.simulations import Given, simulation_of
from station.diagnosis.report.page import html_page
from station.diagnosis.report.sentences import sentence
from station.diagnosis.report.summary import summary
from station.diagnosis.result import Diagnosis
from station.diagnosis.result_json import as_json
from tests.recovery.given_sessions import NEAR, SETTING, recording, session
from tests.unit.diagnosis.recorded import OPENING_RADIUS_M, golden
from tests.unit.simulators.point_block import SCENE, point_block

MU, DROP = 0.35, 0.2


@dataclass(frozen=True)
class Case:
    """Level and drop of the recording, the simulator, and what must be said."""

    recorded: tuple[float, float]
    simulator: Callable[[Path], Given]
    level: bool
    side: str | None


def scene(mu: float) -> Callable[[Path], Given]:
    def written(folder: Path) -> Given:
        (folder / "scene.xml").write_text(SCENE.format(mu=mu), encoding="utf-8")
        (folder / "scene.toml").write_text('block = "cube"\n', encoding="utf-8")
        return folder / "scene.xml"

    return written


def python(mu: float, drop: float = 0.0) -> Callable[[Path], Given]:
    return lambda _: point_block(mu, drop=drop)


CASES = {
    "an effect is left out, and the level": Case((MU, DROP), python(0.25), level=True, side="recording"),
    "the effect is contained": Case((MU, DROP), python(MU, DROP), level=False, side=None),
    "only the simulation has it": Case((MU, 0.0), python(MU, DROP), level=False, side="simulation"),
    "a scene: the level alone": Case((MU, 0.0), scene(0.25), level=True, side=None),
    "a scene: an effect is left out": Case((MU, DROP), scene(MU), level=False, side="recording"),
}


LONG = {
    "an effect is left out, and the level": "four minutes",
    "only the simulation has it": "more than a minute",
    "a scene: an effect is left out": "three minutes",
    "a scene: the level alone": "more than a minute",
}
"""Cases for `pytest -m benchmark`, with what they take on two busy cores."""


def cases() -> list[Any]:
    return [pytest.param(name, marks=[pytest.mark.benchmark] if name in LONG else []) for name in CASES]


def answered(case: Case, folder: Path) -> Diagnosis:
    rig = replace(golden()[1], plate=replace(golden()[1].plate, opening_m=2 * OPENING_RADIUS_M))
    own = simulation_of(case.simulator(folder), rig=rig)
    return simulated_again(recording(*case.recorded), session(*case.recorded), rig=rig, setting=SETTING, simulation=own)


def demand(case: Case, folder: Path) -> None:
    """The difference is named, and the simulator gets better by it."""
    answer = answered(case, folder)
    claimed = [effect for effect in answer.effects if effect.verdict in ("supported", "indistinguishable")]
    assert {effect.side for effect in claimed} == ({case.side} if case.side else set()), sentence(answer)
    assert all(set(effect.class_ids) & NEAR for effect in claimed), sentence(answer)
    assert any(one.name == "mu_s" for one in answer.differs) == case.level, answer.differs
    assert answer.numerics == ()
    _it_gets_better(answer.fit.simulator_rerun, level=case.level, slide=bool(case.side))
    _held_out_figures_are_against_the_simulation(answer, differs=case.level or bool(case.side))
    _told_in_order(answer, case.recorded)


def _it_gets_better(table: Mapping[str, Any], *, level: bool, slide: bool) -> None:
    """Checks that errors fall in runs that the numbers do not know; of the onset the runs' own scatter is left."""
    before, after = table["before"], table["after"]
    assert table["held_out"]
    for figure in ("onset_rmse_deg", "onset_median_deg", "onset_trimmed_deg"):
        if level:
            assert before[figure] - after[figure] > 5.0 * (before["se"][figure] + after["se"][figure])
        else:
            assert after[figure] < before[figure] + before["se"][figure]
    own, now = before["own_level"], after["own_level"]
    for figure in ("path_rmse_mm", "path_median_mm", "path_trimmed_mm"):
        if slide:
            assert own[figure] - now[figure] > own["se"][figure] + now["se"][figure]
        else:
            assert now[figure] < own[figure] + 0.2
    if not level and not slide:
        assert after == before


def _held_out_figures_are_against_the_simulation(answer: Diagnosis, *, differs: bool) -> None:
    fit = answer.fit
    assert np.isfinite(fit.log_score_gain)
    if differs:
        assert fit.log_score_gain > 3.0 * fit.gain_se
    else:
        assert abs(fit.log_score_gain) < 1.0
    if any(one.name == "mu_s" for one in answer.differs):
        assert fit.before.onset_median_deg > 2.0 > fit.after.onset_median_deg


def _told_in_order(answer: Diagnosis, recorded: tuple[float, float]) -> None:
    assert as_json(answer)["fit"]["simulator_rerun"]["after"]["se"]
    console = Console(width=200, record=True, file=io.StringIO())
    console.print(summary(answer))
    told = console.export_text()
    assert "from the simulation to what the recording has" in told
    assert re.search(r"In \S.*, \d+ unseen runs +before +with what was found\s+onset error, median and rms ", told)
    places = [told.find(words) for words in ("Set differently", "in the", "Where:", "Prediction of unseen runs")]
    found = [place for place in places if place >= 0]
    assert found == sorted(found)
    assert "before: the given simulation" in html_page(answer, recording(*recorded).pictures)
