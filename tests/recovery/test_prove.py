"""The small honest subset of the proof: independent cases, a sealed key, one blind run, and what must come out of it.

The bounds are what chance alone cannot give on so few cases; the gates themselves are for `station prove --full`.
"""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from station.prove.protocol import QUICK

pytestmark = [pytest.mark.system, pytest.mark.timeout(1500)]


def prove(out: Path, *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "station", "prove", "--out", str(out), "--seed", "1", *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=1400, check=False)


@pytest.fixture(scope="module")
def proof(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    out = tmp_path_factory.mktemp("proof")
    done = prove(out, "--quick")
    assert done.returncode in (0, 1), done.stdout + done.stderr
    return out, done.stdout


def table(out: Path) -> dict[str, Any]:
    return json.loads((out / "prove.json").read_text("utf-8"))


def gate(out: Path, key: str) -> dict[str, Any]:
    return next(one for one in table(out)["gates"] if one["key"] == key)


def test_the_key_was_sealed_before_the_tool_ran(proof: tuple[Path, str]):
    out, printed = proof
    seals = json.loads((out / "seals.json").read_text("utf-8"))
    results = [path.stat().st_mtime_ns for path in (out / "results").rglob("*.json")]
    assert seals.keys() == QUICK.keys()
    assert (out / "seals.json").stat().st_mtime_ns < min(results)
    for tier, digest in seals.items():
        assert hashlib.sha256((out / "keys" / tier / "key.json").read_bytes()).hexdigest() == digest
        assert digest in printed.replace("\n", "")


def test_every_case_was_diagnosed_without_a_fault(proof: tuple[Path, str]):
    out, _ = proof
    assert len(table(out)["cases"]) == sum(QUICK.values())
    assert gate(out, "faults")["value"] == 0.0


def test_nulls_are_left_in_peace(proof: tuple[Path, str]):
    out, _ = proof
    assert gate(out, "false_alarms")["value"] * gate(out, "false_alarms")["cases"] <= 1
    assert gate(out, "null_loss")["value"] == 0.0


def test_strong_effects_are_seen_and_placed(proof: tuple[Path, str]):
    out, _ = proof
    assert gate(out, "missed")["value"] == 0.0
    assert gate(out, "class")["value"] >= 0.5
    assert gate(out, "place")["value"] > 0.6


def test_it_goes_on_from_where_it_was(proof: tuple[Path, str]):
    out, _ = proof
    before = {path: path.stat().st_mtime_ns for path in (out / "results").rglob("*.json")}
    assert prove(out, "--quick").returncode in (0, 1)
    assert {path: path.stat().st_mtime_ns for path in (out / "results").rglob("*.json")} == before


def test_another_key_in_the_same_folder_is_refused(proof: tuple[Path, str]):
    out, _ = proof
    other = prove(out, "--tier", "null", "--cases", "3")
    assert other.returncode == 2
    assert "Traceback" not in other.stderr
