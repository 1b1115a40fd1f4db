"""Other people's engines under the patch world's block: on a ramp each slips where it is known to."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.proof.engine_family import CONCEALED, EngineFamily
from tests.proof.families import families
from tests.proof.patch_world import places as at
from tests.proof.patch_world.bench import Bench
from tests.proof.patch_world.draws import run_draw
from tests.proof.patch_world.effects import EFFECTS, OUTSIDE
from tests.proof.patch_world.world import Contact, World

ENGINES = {name: family for name, family in families().items() if isinstance(family, EngineFamily)}
LATE_DEG = {"mujoco": (0.0, 0.1), "bullet": (0.0, 0.1), "drake": (0.0, 0.1), "dart": (1.5, 0.4)}
"""The angle by which a block slips late at an azimuth between the axes, and within what."""
AZIMUTH, FRAME_S = 2.0, 0.011


def installed(name: str) -> EngineFamily:
    family = ENGINES[name]
    if why := family.why_not():
        pytest.skip(why)
    return family


def ramp(bench: Bench) -> list[tuple[float, float, float]]:
    """Angle (deg), distance gone (m) and speed (m/s) at each frame of a ramp to 24°, until the block has gone 15 mm."""
    bench.place(0.0, 0.0, 0.3)
    draw = replace(run_draw(bench.world, seed=1, run=1), friction=1.0)
    bench.begin_run(draw, run=1, azimuth=AZIMUTH, before=None)
    bench.ask(math.radians(24), azimuth=AZIMUTH, rate=math.radians(8))
    seen: list[tuple[float, float, float]] = []
    while bench.time_s < 6.0 and not (seen and seen[-1][1] > 0.015):
        bench.advance(round(bench.time_s + FRAME_S, 4))
        s = bench.state
        seen.append((math.degrees(s[at.ANGLE]), math.hypot(s[at.X], s[at.Y]), math.hypot(s[at.VX], s[at.VY])))
    return seen


def onset_deg(seen: list[tuple[float, float, float]]) -> float:
    return next(angle for angle, _, speed in seen if speed > 2e-3)


def test_every_engine_has_a_bound():
    assert ENGINES.keys() == LATE_DEG.keys()


@pytest.mark.parametrize("name", LATE_DEG)
def test_a_block_slips_where_it_should(name: str):
    world, (late, within) = World(), LATE_DEG[name]
    expected = onset_deg(ramp(Bench(world)))
    assert onset_deg(ramp(installed(name).bench(world))) - expected == pytest.approx(late, abs=within)


@pytest.mark.parametrize(("name", "within"), [("mujoco", 1e-3), ("bullet", 1e-3), ("drake", 0.03)])
def test_a_slide_has_the_acceleration_of_its_friction(name: str, within: float):
    slope, contact = math.radians(25), Contact()
    engine = installed(name).engine(contact)
    engine.put(0.0, 0.0, 0.0, mu=contact.mu)
    pull = 9.81 * np.array([math.sin(slope), 0.0, -math.cos(slope)])
    places: list[float] = []
    for _ in range(250):
        engine.step(pull, np.zeros(2), 0.0)
        places.append(engine.read()[0])
    found = 2.0 * np.polyfit(engine.step_s * np.arange(50, 250), places[50:], 2)[0]
    assert found == pytest.approx(9.81 * (math.sin(slope) - contact.mu * math.cos(slope)), rel=within)


def test_bad_settings_are_not_the_good_ones():
    world = World()
    soft = ENGINES["mujoco"].bad(Contact())
    soft.put(0.0, 0.0, 0.0, mu=world.contact.mu)
    slope = math.radians(15)
    for _ in range(1000):
        soft.step(9.81 * np.array([math.sin(slope), 0.0, -math.cos(slope)]), np.zeros(2), 0.0)
    assert soft.read()[0] > 1e-3, "it creeps by a millimetre in two seconds, 5° below the angle of friction"


def test_what_is_concealed_acts_without_the_contacts_own_law():
    assert set(CONCEALED["outside"]) <= set(OUTSIDE)
    assert all(EFFECTS[name].catalogue != "none" for name in CONCEALED["single"])


def test_a_case_is_whole_only_with_its_record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("tests.proof.engine_family.RUNS", 2)
    family = ENGINES["mujoco"]
    plan = family.plan("null", 0, seed=3)
    assert plan == family.plan("null", 0, seed=3)
    (tmp_path / "case").mkdir()
    family.write(plan, tmp_path / "case", key=tmp_path / "key")
    assert sorted(path.name for path in (tmp_path / "case").iterdir()) == ["rig.toml", "session.mcap"]
    assert (tmp_path / "key" / "truth" / f"{plan.id}.json").read_text("utf-8") == "{}\n"
