"""`station demo`: what is concealed, sealed, found and revealed."""

from __future__ import annotations

import hashlib
import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shared.errors import UserError
from station.__main__ import main
from station.app import demonstration
from station.app.demonstration import PLAIN, conceal, drawn, firm_rig, reveal
from station.app.planting import plant
from station.diagnosis.result import Diagnosis, EffectFound, FitQuality, Value
from station.physics.catalogue import catalogue
from station.recording.reader import open_recording
from tests.readmes.blocks import blocks
from tests.readmes.numbers import numbers_of, without_numbers

KNOWN = catalogue()


@pytest.mark.timeout(900)  # two minutes of processor time, and as many times as long on a machine that does much else
def test_the_whole_story(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["demo", "--seed", "104", "--out", str(tmp_path)]
    assert main(words) == 0
    said, folder = capsys.readouterr().out, tmp_path / "104"
    sealed = re.search("sha256 ([0-9a-f]{64})", said)
    assert sealed
    assert sealed[1] == hashlib.sha256((folder / "key.toml").read_bytes()).hexdigest()
    assert said.index(sealed[1]) < said.index("Prediction of unseen runs") < said.index("Concealed:")
    assert list(tomllib.loads((folder / "key.toml").read_text("utf-8"))["effects"]) == ["uneven_contact"]
    assert_as_on_the_first_page(said)
    assert (folder / "report.html").stat().st_size > 10_000
    # Nothing in the recording says what is concealed.
    session = open_recording(folder / "session.mcap")
    assert "model.toml" not in session.attachments
    assert b"uneven_contact" not in b"".join(session.attachments.values())
    assert "uneven_contact" not in str(session.metadata)
    # A sealed case is not sealed again.
    assert main(words) == 2


def assert_as_on_the_first_page(said: str) -> None:
    """The first page shows this demonstration: the words are the same, and the numbers but for their last digits."""
    (shown,) = (one.text for one in blocks("text") if one.readme == "README.md" and "Concealed:" in one.text)
    revealed = said[said.index("Concealed:") : said.index("Open the report:")]
    before, shown, after = shown.split("…")  # the diagnosis stands before, and what to do next after
    assert before.strip() == after.strip() == ""
    assert without_numbers(revealed) == without_numbers(shown), revealed
    # A twentieth, or two of the last digits of a hundredth of a millimetre: half as much again is another result.
    assert numbers_of(revealed) == pytest.approx(numbers_of(shown), rel=0.05, abs=0.02), revealed


def test_the_key_is_sealed_before_there_is_a_session(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuses(*_: object, **__: object) -> None:
        raise UserError("Expected no session yet")

    monkeypatch.setattr(demonstration, "Recording", refuses)
    assert main(["demo", "--seed", "3", "--out", str(tmp_path)]) == 2
    sealed = hashlib.sha256((tmp_path / "3" / "key.toml").read_bytes()).hexdigest()
    assert f"sha256 {sealed}" in " ".join(capsys.readouterr().out.split())


def test_draws_differ_and_are_as_large_as_is_shown() -> None:
    drawings = [drawn(KNOWN, np.random.default_rng(seed)).terms for seed in range(60)]
    assert {term.effect.id for (term,) in drawings} == {one.id for one in KNOWN.values() if one.demonstrated}
    for (term,) in drawings:
        for name, least in term.effect.demonstrated.items():
            assert abs(term.values[name]) >= least
    assert drawn(KNOWN, np.random.default_rng(3)) == drawn(KNOWN, np.random.default_rng(3))


def test_nothing_else_is_planted() -> None:
    rig = firm_rig()
    assert "sag_px" not in rig.camera.options.values
    assert not rig.planted
    assert "sag" not in rig.text, "nor in the recording's copy of the file"


def found(*effects: EffectFound) -> Diagnosis:
    nothing = Value(value=0.4, sd=0.01, unit="1")
    return Diagnosis(
        recording="session.mcap", total_runs=60, used_runs=60, held_out_runs=60, simulator="planar", mu_s=nothing,
        scatter=0.05, global_p=1e-6, verdict="supported", located=(), effects=effects, other_probability=0.0,
        none_probability=0.0, fit=FitQuality.unknown(), next_experiment=None, candidates_tried=1, candidates=(),
        untestable={}, numerics=(), notes=(), model={},
    )  # fmt: skip


def effect(name: str, *others: str) -> EffectFound:
    return EffectFound(
        id=name, title=KNOWN[name].title, class_ids=(name, *others), probability=0.99, verdict="supported",
        parameters={}, separated_by="",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("effects", "last", "right"),
    [
        ((effect("stribeck"),), "Right.", True),
        ((effect("kinetic_drop", "stribeck"),), "Right.", True),
        ((effect("stribeck"), effect("wear")), "Right, with a further name.", True),
        (
            (effect("wear"), effect("stribeck")),
            "Wrong: the effect is named, but only after something that was not concealed.",
            False,
        ),
        ((effect("viscous"),), "Wrong, by a name that is easily confused with it.", False),
        ((effect("wear"),), "Wrong.", False),
        ((), "Missed: the effect was not named.", False),
        ((replace(effect("stribeck"), verdict="not supported"),), "Missed: the effect was not named.", False),
    ],
)
def test_right_or_wrong_it_is_said(effects: tuple[EffectFound, ...], last: str, right: bool) -> None:
    revealed = reveal(plant(["stribeck=0.3"], PLAIN, KNOWN), found(*effects), KNOWN)
    assert (revealed.lines[-1], revealed.right) == (last, right)


@pytest.mark.parametrize(
    ("answer", "last"),
    [
        (
            replace(found(), verdict="untestable", notes=("the block never slid",)),
            "Not named, because this recording could not show the effect: the block never slid.",
        ),
        (
            replace(found(), untestable={"stribeck": "no slide was fast"}),
            "Not named, because this recording could not show the effect: no slide was fast.",
        ),
        (
            replace(found(effect("wear")), untestable={"stribeck": "no slide was fast"}),
            "Wrong; this recording could not show the effect: no slide was fast.",
        ),
        (replace(found(), untestable={"wear": "too few runs"}), "Missed: the effect was not named."),
    ],
)
def test_an_effect_that_could_not_show_was_not_missed(answer: Diagnosis, last: str) -> None:
    revealed = reveal(plant(["stribeck=0.3"], PLAIN, KNOWN), answer, KNOWN)
    assert (revealed.lines[-1], revealed.right) == (last, False)


def test_an_effect_that_changes_nothing_was_not_missed() -> None:
    """A cube topples at 45°, and slides long before."""
    revealed = reveal(plant(["tipping=1"], PLAIN, KNOWN), found(), KNOWN, shows=False)
    assert revealed.lines[-1].endswith("this recording could not show the effect: the session is the same without it.")


@pytest.mark.parametrize(("effect_id", "shows"), [("tipping=1", False), ("wear=0.3", True)])
def test_it_is_known_whether_the_effect_changes_the_session(effect_id: str, shows: bool, tmp_path: Path) -> None:
    model = plant([effect_id], PLAIN, KNOWN)
    concealed = conceal(model, tmp_path, np.random.default_rng(1), samples=2, seed=1)
    assert concealed.shows == shows
    assert concealed.recording.exists()


def test_what_is_found_is_told_in_words_and_in_millimetres() -> None:
    """A size that may be nothing, a shape and the coefficients of a curve say nothing to who reads it."""
    sole = replace(
        effect("uneven_contact"),
        parameters={
            "x_m": Value(value=-0.0018, sd=0.00005, unit="m"),
            "y_m": Value(value=0.00003, sd=0.00005, unit="m"),
            "lead": Value(value=0.0006, sd=0.0002, unit="1"),
        },
    )
    curve = replace(
        effect("wear"),
        id="other",
        class_ids=("other", "kinetic_drop"),
        parameters={"a0": Value(value=0.2, sd=0.01, unit="1")},
    )
    lines = reveal(plant(["uneven_contact=-0.0018"], PLAIN, KNOWN), found(sole, curve), KNOWN).lines
    assert lines[0] == "Concealed: friction that differs over the sole: x = -1.8 mm"
    assert lines[1] == (
        "Found:     friction that differs over the sole, probability 0.99: x = -1.800 ± 0.050 mm; "
        "something outside the catalogue or kinetic friction below static, probability 0.99"
    )


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--effect", "kinetic_drp=0.3"], "did you mean kinetic_drop?"),
        (["--effect", "wear=0.2", "--effect", "viscous=0.1"], "Expected one effect"),
        (["--effect", "wear=0.2", "--samples", "0"], "Expected --samples to be 1 or more"),
    ],
)
def test_what_cannot_be_shown_is_said(
    words: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["demo", "--out", str(tmp_path), *words]) == 2
    assert said in capsys.readouterr().err
