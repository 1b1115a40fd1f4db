"""An answer that several processes of the tests ask for is computed once, by the first of them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests import answers
from tests.answers import FOLDER, once

ROOT = Path(__file__).parents[2]
ASKS = """
import time
from pathlib import Path
from tests.answers import once

def answer():
    time.sleep(0.2)
    with Path({told!r}).open("a") as file:
        file.write("asked\\n")
    return lambda: 42.0

print(once(("what", 6, 7), answer)())
"""


def test_processes_that_ask_the_same_at_once_get_one_answer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(FOLDER, str(tmp_path))
    told = tmp_path / "told"
    words = [sys.executable, "-c", ASKS.format(told=str(told))]
    asking = [subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, text=True) for _ in range(3)]
    assert [one.communicate()[0] for one in asking] == ["42.0\n"] * 3
    assert told.read_text("utf-8") == "asked\n"


def test_another_question_gets_another_answer_and_the_same_one_the_same_object(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(FOLDER, str(tmp_path))
    first, second = once(("test", 1), lambda: ["one"]), once(("test", 2), lambda: ["two"])
    assert (first, second) == (["one"], ["two"])
    assert once(("test", 1), lambda: ["three"]) is first
    monkeypatch.setattr(answers, "_KNOWN", {})  # as another process
    assert once(("test", 1), lambda: ["three"]) == ["one"]


def test_what_fails_is_asked_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(FOLDER, str(tmp_path))

    def fails() -> str:
        raise ValueError("no answer")

    with pytest.raises(ValueError, match="no answer"):
        once(("test", 3), fails)
    assert once(("test", 3), lambda: "now") == "now"
