import hashlib
import json
from pathlib import Path

import pytest

from shared.errors import UserError
from tests.proof.families import families
from tests.proof.key import open_key, truth_of
from tests.proof.protocol import Protocol
from tests.proof.said import read_said
from tests.unit.proof.made_up import concealed


@pytest.fixture
def protocol(tmp_path: Path) -> Protocol:
    protocol = Protocol(tiers={"single": 1}, seed=1, out=tmp_path)
    entry = {
        "tier": "single", "answer": "effects", "effects": [concealed("wear", strength=2.0, wear=0.1)], "places": [],
        "design": {"runs": 9},
    }  # fmt: skip
    text = json.dumps({"cases": {"a1": entry}})
    protocol.key("single").mkdir(parents=True)
    (protocol.key("single") / "key.json").write_text(text, encoding="utf-8")
    protocol.seals.write_text(json.dumps({"single": hashlib.sha256(text.encode()).hexdigest()}), encoding="utf-8")
    return protocol


def test_the_sealed_key_opens(protocol: Protocol):
    truth = truth_of("a1", open_key(protocol, "single")["cases"]["a1"])
    assert truth.ids == {"wear"}
    assert truth.weakest == 2.0
    assert truth.effects[0].parameters == {"wear": 0.1}


def test_a_key_that_was_changed_is_refused(protocol: Protocol):
    path = protocol.key("single") / "key.json"
    path.write_text(path.read_text("utf-8").replace("wear", "tear"), encoding="utf-8")
    with pytest.raises(UserError, match="sealed"):
        open_key(protocol, "single")


def test_a_result_of_another_version_of_the_tool_is_refused(tmp_path: Path):
    path = tmp_path / "a1.json"
    path.write_text(json.dumps({"tool": "old", "wall_s": 1.0, "answer": {"effects": []}}), encoding="utf-8")
    assert read_said(path, digest="old").first == "none"
    with pytest.raises(UserError, match="no retries"):
        read_said(path, digest="new")


def test_the_key_does_not_lie_among_the_cases(protocol: Protocol):
    assert not protocol.key("single").is_relative_to(protocol.out / "cases")


def test_each_family_has_the_nulls_that_its_gate_is_about():
    for family in families().values():
        if set(family.full) == {"artefact"}:
            continue
        nulls = sum(count for tier, count in family.full.items() if "null" in tier or family.name == "real")
        assert nulls >= (100 if family.name in ("own", "patch_world", "real") else 40), family.name
