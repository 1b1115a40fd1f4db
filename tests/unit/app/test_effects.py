"""`station effects`: the whole catalogue in a list, and each effect in its own words."""

from __future__ import annotations

import json

import pytest

from station.__main__ import main
from station.physics.catalogue import catalogue

KNOWN = catalogue()


def test_the_list_has_every_effect_with_its_law_and_parameters(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["effects"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 100
    paragraphs = {text.split(maxsplit=1)[0]: " ".join(text.split()) for text in "\n".join(lines).split("\n\n")}
    for effect in KNOWN.values():
        said = paragraphs[effect.id]
        assert f"law: {' '.join(effect.law.split())} typical: " in said
        assert all(one.name in said for one in effect.parameters)


def test_an_effect_is_explained(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["effects", "stribeck"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "v_s = speed_m_s (m/s): " in said
    effect = KNOWN["stribeck"]
    for words in (effect.law, effect.source, effect.separated_by, *effect.confounded_with):
        assert " ".join(words.split()) in said


def test_as_json_it_is_the_catalogue(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["effects", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert {one["id"] for one in told} == set(KNOWN)
    drop = next(one for one in told if one["id"] == "kinetic_drop")
    numbers = {"unit": "1", "low": 0.0, "high": 0.6, "typical": 0.1, "null": 0.0}
    assert drop["parameters"] == [{"name": "drop", "symbol": "d"} | numbers]


@pytest.mark.parametrize(
    ("name", "hint"), [("stribek", "did you mean stribeck?"), ("nope", "`station effects` lists them")]
)
def test_an_unknown_one_gets_a_hint(name: str, hint: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["effects", name]) == 2
    assert capsys.readouterr().err.endswith(f"Expected an effect's id, got '{name}'; {hint}\n")
