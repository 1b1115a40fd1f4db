"""The tiers plan cases, and a written case says nothing of what is concealed in it."""

import json
import math
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from numpy.random import Generator

from shared.errors import UserError
from shared.rig import load_rig
from station.app.lockstep import Outcome
from station.recording.reader import open_recording
from tests.concealed.design import PAIRS
from tests.concealed.making import make
from tests.frames import cases
from tests.frames.cases import TIERS, Plan, plan_case, write_case
from tests.frames.effects import EFFECTS
from tests.frames.sessions import rig_toml
from tests.proof.families.own import EXACT, INEXACT
from tests.proof.key import truth_of
from tests.unit.frames.worlds import DESIGN


def test_every_third_case_of_frames_conceals_nothing_and_the_others_take_turns():
    plans = [plan_case("frames", index, seed=4) for index in range(15)]
    assert [plan.effect == "" for plan in plans] == [index % 3 == 2 for index in range(15)]
    assert {plan.effect for plan in plans} == {*EFFECTS, ""}
    assert len({plan.id for plan in plans}) == 15


def test_a_null_of_the_twin_conceals_nothing_on_any_pair():
    plans = [plan_case("twin_null", index, seed=4) for index in range(8)]
    assert {plan.effect for plan in plans} == {""}
    assert {plan.design.pair for plan in plans} == set(PAIRS)
    assert all(50 <= plan.design.runs <= 120 and 0.05 <= plan.design.scatter <= 0.14 for plan in plans)


def test_the_same_arguments_give_the_same_plan():
    assert plan_case("frames", 1, seed=4) == plan_case("frames", 1, seed=4)
    assert plan_case("frames", 1, seed=4).id != plan_case("frames", 1, seed=5).id


def test_only_some_effects_can_be_asked_for():
    assert {plan_case("frames", n, seed=1, only=("wear", "viscous")).effect for n in range(4)} == {"wear", "viscous"}
    with pytest.raises(ValueError, match="expected some of kinetic_drop"):
        plan_case("frames", 0, seed=1, only=("no_such_effect",))


@pytest.mark.parametrize("name", EFFECTS)
def test_the_scorer_reads_the_key_in_its_own_words(name: str, tmp_path: Path):
    plan = plan_case("frames", 0, seed=1, only=(name,))
    told = truth_of(plan.id, json.loads(json.dumps(plan.entry)))
    (effect,) = told.effects
    assert (told.answer, effect.id) == ("effects", name)
    assert math.isnan(effect.strength)
    assert name in EXACT or name in INEXACT
    if name in EXACT:
        (tmp_path / "rig.toml").write_text(rig_toml(plan.design, mu_guess=plan.mu_guess), encoding="utf-8")
        assert EXACT[name].to_tool(effect.parameters, told, load_rig(tmp_path / "rig.toml"))


def small(tier: str, *, effect: str, seed: int = 3) -> Plan:
    """A case of three runs, or of one where each frame is drawn."""
    plan = plan_case(tier, 0, seed=seed, only=(effect,) if tier == "frames" else ())
    return replace(plan, design=replace(DESIGN, runs=1 if tier == "frames" else 3))


def written(plan: Plan, out: Path) -> Path:
    write_case(plan, out)
    return out / plan.id / "session.mcap"


@pytest.fixture(scope="module")
def through_frames(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(small("frames", effect="camera_sag"), tmp_path_factory.mktemp("frames"))


def test_frames_go_through_the_real_tracker(through_frames: Path):
    reader = open_recording(through_frames)
    assert len(reader.samples()) == 1
    status = [item.message for item in reader.messages({"camera/status"})]
    assert status
    assert all(getattr(one, "version", "") != "projected" for one in status)


def test_a_recording_tells_nothing(through_frames: Path, tmp_path: Path):
    plain = written(small("twin_null", effect=""), tmp_path)
    for path in (through_frames, plain):
        reader = open_recording(path)
        assert not any(name.startswith("truth") for name in reader.topics)
        assert "camera/image" not in reader.topics
        rig = (path.parent / "rig.toml").read_text("utf-8")
        assert "sag" not in rig
        raw = path.read_bytes()
        assert rig.encode() in raw
        assert b"plan.toml" not in raw
        assert b"sag_px" not in raw
    assert set(open_recording(through_frames).topics) == set(open_recording(plain).topics)


def test_the_same_arguments_give_the_same_bytes(tmp_path: Path):
    first, again = (written(small("twin_null", effect=""), tmp_path / name) for name in ("first", "again"))
    assert first.read_bytes() == again.read_bytes()


class Broken:
    """A session that ends at once."""

    def run(self) -> Outcome:
        return Outcome(samples=0, simulated_s=0.0, fault="the block does not come to rest")


def test_a_session_that_ends_early_is_begun_again_and_given_up_in_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    plan, real, begun = small("twin_null", effect=""), cases.session_of, list[float]()

    def breaks(count: int) -> None:
        def session(*given: Any, rng: Generator) -> Any:
            begun.append(float(rng.random()))
            return Broken() if len(begun) <= count else real(*given, rng=rng)

        begun.clear()
        monkeypatch.setattr(cases, "session_of", session)

    breaks(2)
    assert len(open_recording(written(plan, tmp_path)).samples()) == 3
    assert len(set(begun)) == 3
    breaks(99)
    with pytest.raises(UserError, match="5 sessions ended early, the last after 0: the block does not come to rest"):
        written(plan, tmp_path / "never")
    assert not list((tmp_path / "never").rglob("session.mcap"))


def test_the_key_is_sealed_before_a_recording_exists(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    there: list[bool] = []

    def watch(plan: Plan, out: Path) -> None:
        there.append((tmp_path / "keys" / "key.sha256").exists() and not out.joinpath(plan.id).exists())
        folder = out / plan.id
        folder.mkdir()
        (folder / "rig.toml").touch()
        (folder / "session.mcap").touch()

    words = ["--tier", "frames", "--cases", "2", "--seed", "1", "--out", str(tmp_path / "cases")]
    words += ["--key", str(tmp_path / "keys")]
    made = partial(make, prog="x", about="", tiers=TIERS, plan=plan_case, write=watch)
    for expected in ([True, True], [True, True]):
        assert made(words) == 0
        assert there == expected, "what is there is left as it is"
    said = capsys.readouterr()
    assert said.out.count("key sha256 ") == 2
    assert "written 2 of 2" in said.err
    assert made([*words[:4], "--seed", "2", *words[6:]]) == 2
