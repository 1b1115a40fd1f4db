"""The systemd unit is one that systemd accepts, and as closed as it says."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from station.app.deploy.bundle import unit_text

ANALYZE = shutil.which("systemd-analyze")
WORST_SCORE = 2.0


@pytest.fixture
def unit(tmp_path: Path) -> Path:
    """The unit with its paths below a folder where its program exists, which `verify` looks for."""
    if ANALYZE is None:
        reason = "no systemd-analyze here: apt-get install systemd"
        if "deploy" in os.environ.get("REPOSE_REQUIRE", "").split(","):
            pytest.fail(reason)
        pytest.skip(reason)
    python = tmp_path / "opt/repose/current/venv/bin/python"
    python.parent.mkdir(parents=True)
    python.touch(mode=0o755)
    file = tmp_path / "pi-agent.service"
    file.write_text(unit_text(str(tmp_path)))
    return file


def analyze(*words: str) -> str:
    assert ANALYZE is not None
    done = subprocess.run([ANALYZE, *words, "--no-pager"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


def test_systemd_finds_nothing_wrong_with_the_unit(unit: Path):
    said = analyze("verify", str(unit))
    assert not [line for line in said.splitlines() if "pi-agent" in line]


def test_the_exposure_is_low(unit: Path):
    said = analyze("security", "--offline=true", str(unit))
    score = re.search(r"Overall exposure level for \S+: ([\d.]+)", said)
    assert score, said
    print(f"systemd-analyze security: {score.group(1)} of 10")
    assert float(score.group(1)) <= WORST_SCORE


def test_the_unit_keeps_the_agents_promises():
    text = unit_text()
    lines = set(text.splitlines())
    assert {"Type=notify", "Restart=always", "User=repose", "SupplementaryGroups=video", "NoNewPrivileges=yes"} <= lines
    assert re.search(r"^WatchdogSec=\d+$", text, re.MULTILINE)
    assert re.search(r"^MemoryMax=\d+M$", text, re.MULTILINE)
    assert "/opt/repose/current/venv/bin/python -m pi_agent run --rig /opt/repose/current/rig.toml" in text


def test_below_another_root_no_path_leaves_it():
    text = unit_text("/home/me/target")
    assert "/home/me/target/opt/repose/current/venv" in text
    assert not re.findall(r"(?<!/home/me/target)/opt/repose", text)
