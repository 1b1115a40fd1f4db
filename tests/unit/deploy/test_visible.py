"""The words of a Pi that somebody else has taken over: this computer's terminal shows them, and obeys none."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Sequence
from typing import Any

import pytest

from station.app.commands import deploy
from station.app.deploy import remote
from station.app.deploy.remote import Remote
from station.app.deploy.steps import Deployment, Wishes

CLEAR = "\x1b[2J\x1b]0;a title\x07"
PROBED = f"uid=0\nmachine=aarch64\nmodel=Pi{CLEAR}\n"
FOUND = {"pid": 1, "current": f"r{CLEAR}", "previous": None, "log": f"{CLEAR}Verified: 450 corners\nthe end"}
TOLD = {**FOUND, "clock": {"source": CLEAR, "offset_s": 0.001}, "did": f"went back{CLEAR}", "left": [f"a{CLEAR}"]}


@pytest.fixture
def deployment(monkeypatch: pytest.MonkeyPatch) -> Deployment:
    """A target whose every answer has sequences that clear a terminal and name its window."""

    def run(words: Sequence[str], **_: Any) -> subprocess.CompletedProcess[bytes]:
        said = PROBED if "sh -s" in words[-1] else json.dumps(TOLD)
        return subprocess.CompletedProcess(words, 0, said.encode(), b"")

    monkeypatch.setattr(remote.subprocess, "run", run)
    return Deployment(Remote("pi@nowhere", port=None, identity=None, options=()), Wishes(supervisor="none"))


def test_the_status_shows_what_a_terminal_would_obey(
    deployment: Deployment, capsys: pytest.CaptureFixture[str]
) -> None:
    assert deploy._status(deployment) == 0  # pyright: ignore[reportPrivateUsage]
    printed = capsys.readouterr().out
    assert "\x1b" not in printed
    assert "\x07" not in printed
    assert "Release r␛[2J␛]0;a title␇, the agent runs (process 1)." in printed
    assert "corners\nthe end\n" in printed, "a log has its lines"


def test_whatever_else_the_target_says_is_visible(deployment: Deployment) -> None:
    assert deployment.facts.model.startswith("Pi␛[2J")
    assert deployment.roll_back().startswith("went back␛")
    assert deployment.uninstall(purge=False)[0].startswith("a␛")
