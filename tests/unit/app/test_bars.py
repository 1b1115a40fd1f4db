"""Progress through a known number of things: lines in a log, a bar on a terminal."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from station.app import progress
from station.app.bars import counting


def shown(monkeypatch: pytest.MonkeyPatch, *, terminal: bool) -> str:
    monkeypatch.setattr(progress, "EVERY_S", 0.0)
    out = io.StringIO()
    with counting(Console(file=out, force_terminal=terminal, width=120), "drawing", total=8, what="messages") as done:
        for number in range(1, 9):
            done(number)
    return out.getvalue()


def test_a_log_has_lines_and_a_terminal_a_bar(monkeypatch: pytest.MonkeyPatch) -> None:
    logged, drawn = shown(monkeypatch, terminal=False), shown(monkeypatch, terminal=True)
    assert logged.endswith("8 of 8 messages in 0 s, about 0 s left\n")
    assert "drawing" not in logged
    assert "drawing" in drawn
    assert "8/8" in drawn
    assert "of 8 messages" not in drawn


def test_quick_work_says_nothing_in_a_log() -> None:
    out = io.StringIO()
    with counting(Console(file=out), "drawing", total=1, what="messages") as done:
        done(1)
    assert out.getvalue() == ""
