"""Families that plan their own cases: the key is sealed first, and a case that is there is left alone."""

from __future__ import annotations

import io
import json
from pathlib import Path

import pytest
from rich.console import Console

from tests.proof.families import families, recording_of
from tests.proof.families.real import SOURCES, Real
from tests.proof.key import truth_of
from tests.proof.protocol import Protocol
from tests.proof.run import prove
from tests.proof.writing import main

needs_data = pytest.mark.skipif(Real().why_not() is not None, reason=str(Real().why_not()))


def words(out: Path, seed: int = 3) -> list[str]:
    folders = ["--out", str(out / "cases" / "means"), "--key", str(out / "keys" / "means")]
    return ["real", "--tier", "means", "--cases", "2", "--seed", str(seed), *folders]


@needs_data
def test_real_data_are_nulls_whose_labels_are_dealt_by_the_seed(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    assert main(words(tmp_path)) == 0
    assert "key sha256 " in capsys.readouterr().out
    protocol = Protocol(tiers={"means": 2}, seed=3, out=tmp_path)
    told = json.loads((protocol.key("means") / "key.json").read_text("utf-8"))
    truths = list(families()["real"].truths(protocol, "means", told))
    assert [(one.kind, one.answer, one.effects) for one in truths] == [("null", "none", ())] * 2
    tables = [recording_of(protocol.cases("means") / one.id) for one in truths]
    assert tables[0] is not None
    assert tables[1] is not None
    assert tables[0].read_bytes() != tables[1].read_bytes()
    written = tables[0].stat().st_mtime_ns
    assert main(words(tmp_path)) == 0
    assert tables[0].stat().st_mtime_ns == written


@needs_data
def test_a_folder_of_another_key_is_refused(tmp_path: Path):
    assert main(words(tmp_path)) == 0
    assert main(words(tmp_path, seed=4)) == 2


def test_data_that_are_not_here_are_said_to_be_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    missing = {name: tmp_path / path.name for name, path in SOURCES.items()}
    monkeypatch.setattr("tests.proof.families.real.SOURCES", missing)
    assert f"there is no {tmp_path}" in str(Real().why_not())


def test_a_family_that_is_left_out_is_said_to_be(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Nothing but an empty table was printed."""
    missing = {name: tmp_path / path.name for name, path in SOURCES.items()}
    monkeypatch.setattr("tests.proof.families.real.SOURCES", missing)
    console = Console(file=io.StringIO(), width=60)
    protocol = Protocol(tiers={"means": 2}, seed=3, out=tmp_path)
    found = prove(Real(), protocol, jobs=1, rivalled=0, refits=False, console=console)
    assert found.cases == ()
    assert isinstance(console.file, io.StringIO)
    assert f"real/means is left out: there is no {tmp_path}" in console.file.getvalue()


@pytest.mark.parametrize(("tier", "kind"), [("twin_null", "null"), ("null_nuisance", "null"), ("tosses", "null")])
def test_a_tier_of_any_name_without_an_effect_is_a_null(tier: str, kind: str):
    entry = {"tier": tier, "answer": "none", "effects": [], "places": [], "design": {}}
    assert truth_of("a", entry).kind == kind
